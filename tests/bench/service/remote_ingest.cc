// Points appended over one stream.

#include <chrono>
#include <memory>

#include "core/hull/growth/hull_builder.h"
#include "tests/bench/hulls/clouds.h"
#include "tests/bench/service/remote_subject.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Cloud {
  std::vector<Vector> points;
  std::vector<v1::PointBlock> chunks;
};

// Returns a ball in chunks of about 1 MiB, as the client sends files.
std::shared_ptr<Cloud> MakeBall(size_t count, bool in_floats) {
  constexpr size_t kChunkBytes = 1 << 20;
  const size_t chunk_points = kChunkBytes / 3 / (in_floats ? sizeof(float) : sizeof(double));
  auto cloud = std::make_shared<Cloud>();
  cloud->points = MakeCloud("ball:" + std::to_string(count));
  for (size_t i = 0; i < count; ++i) {
    if (i % chunk_points == 0) cloud->chunks.emplace_back();
    v1::PointBlock& chunk = cloud->chunks.back();
    Vector& p = cloud->points[i];
    for (int k = 0; k < 3; ++k) {
      if (in_floats) {
        chunk.add_xyz_float(static_cast<float>(p[k]));
        p[k] = static_cast<float>(p[k]);
      } else {
        chunk.add_xyz(p[k]);
      }
    }
  }
  return cloud;
}

double Rate(const Cloud& cloud, Clock::time_point start) {
  return static_cast<double>(cloud.points.size()) /
         std::chrono::duration<double>(Clock::now() - start).count();
}

Sample Ingest(RemoteSubject& subject, const Cloud& cloud) {
  const std::string id = "ingest/ball";
  AppendOptions options;
  options.create_if_absent = true;
  const auto start = Clock::now();
  auto appender = subject.client().OpenAppend(id, options);
  CheckOk(appender.status(), "opening an append");
  for (const v1::PointBlock& chunk : cloud.chunks) {
    CheckOk((*appender)->Append(chunk), "an append");
  }
  CheckOk((*appender)->Finish(), "an append");
  const Sample sample{Rate(cloud, start)};
  CheckOk(subject.client().DeleteHull(id).status(), "deleting");
  return sample;
}

Sample Build(const Cloud& cloud, size_t chunk_points) {
  const auto start = Clock::now();
  HullBuilder builder;
  for (size_t i = 0; i < cloud.points.size(); i += chunk_points) {
    const std::span<const Vector> rest = std::span(cloud.points).subspan(i);
    CheckOk(builder.Add(rest.first(std::min(chunk_points, rest.size()))).status(), "building");
  }
  return {Rate(cloud, start)};
}

}  // namespace

std::vector<RemoteWorkload> MakeIngestWorkloads() {
  constexpr size_t kPoints = 4'000'000;
  std::vector<RemoteWorkload> workloads;
  for (const bool in_floats : {false, true}) {
    const std::shared_ptr<Cloud> cloud = MakeBall(kPoints, in_floats);
    const size_t chunk_points =
        (cloud->chunks[0].xyz_size() + cloud->chunks[0].xyz_float_size()) / 3;
    workloads.push_back({std::string("ingest ball, ") + (in_floats ? "floats" : "doubles"),
                         "points", [=](RemoteSubject& subject) { return Ingest(subject, *cloud); },
                         [=] { return Build(*cloud, chunk_points); }});
  }
  return workloads;
}

}  // namespace hulld::bench
