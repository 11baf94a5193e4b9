// Hull building against qhull and CGAL, on the same points, in one process:
//
//   hull_benchmark --benchmark_enable_random_interleaving=true --benchmark_repetitions=5
//       --benchmark_report_aggregates_only=true --benchmark_format=csv
//
// Counters in the row of each time: `points`, `vertices` of the hull found, and `missing_or_extra`,
// by how many vertices that differs from hulld's exact hull. hulld's own row holds the verdict of
// an exact audit.

#include <benchmark/benchmark.h>

#include <memory>
#include <string>

#include "core/hull/audit.h"
#include "core/hull/hull_builder.h"
#include "tests/bench/clouds.h"
#include "tests/bench/peer_hulls.h"

namespace hulld::bench {
namespace {

Hull BuildHull(const std::vector<Vector>& points) {
  HullBuilder builder;
  if (!builder.Add(points).ok()) std::abort();
  return builder.Snapshot();
}

// One cloud in the types of all libraries, made when the first benchmark asks for it.
class Workload {
 public:
  explicit Workload(std::string name) : name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  const std::vector<Vector>& points() {
    if (points_.empty()) points_ = MakeCloud(name_);
    return points_;
  }
  size_t vertices() {
    if (vertices_ == 0) vertices_ = BuildHull(points()).vertices().size();
    return vertices_;
  }

 private:
  std::string name_;
  std::vector<Vector> points_;
  size_t vertices_ = 0;
};

void Report(benchmark::State& state, Workload& workload, size_t vertices) {
  const auto difference = static_cast<double>(vertices) - static_cast<double>(workload.vertices());
  state.counters["points"] = static_cast<double>(workload.points().size());
  state.counters["vertices"] = static_cast<double>(vertices);
  state.counters["missing_or_extra"] = difference < 0 ? -difference : difference;
}

bool SkipWithoutData(benchmark::State& state, Workload& workload) {
  if (!workload.points().empty()) return false;
  state.SkipWithError("skipped: no data");
  return true;
}

void BuildByHulld(benchmark::State& state, Workload& workload) {
  if (SkipWithoutData(state, workload)) return;
  size_t vertices = 0;
  for (auto _ : state) {
    HullBuilder builder;
    benchmark::DoNotOptimize(builder.Add(workload.points()));
    vertices = builder.vertex_count();
  }
  Report(state, workload, vertices);
  const bool ok = AuditHull(BuildHull(workload.points())).ok();
  if (!ok) state.SkipWithError("the audit failed");
}

void StreamIntoHulld(benchmark::State& state, Workload& workload) {
  size_t vertices = 0;
  for (auto _ : state) {
    HullBuilder builder;
    for (const Vector& point : workload.points()) {
      benchmark::DoNotOptimize(builder.Add(std::span(&point, 1)));
    }
    vertices = builder.vertex_count();
  }
  Report(state, workload, vertices);
}

void BuildByQhull(benchmark::State& state, Workload& workload) {
  if (SkipWithoutData(state, workload)) return;
  std::vector<double> coordinates;
  for (const Vector& p : workload.points())
    coordinates.insert(coordinates.end(), p.begin(), p.end());
  size_t vertices = 0;
  for (auto _ : state) vertices = QhullVertices(coordinates);
  Report(state, workload, vertices);
}

void BuildByCgal(benchmark::State& state, Workload& workload) {
  if (SkipWithoutData(state, workload)) return;
  const CgalPoints points(workload.points());
  size_t vertices = 0;
  for (auto _ : state) vertices = points.HullVertices();
  Report(state, workload, vertices);
}

void Register() {
  const auto add = [](const std::string& library, void (*function)(benchmark::State&, Workload&),
                      const std::shared_ptr<Workload>& workload) {
    benchmark::RegisterBenchmark((workload->name() + "/" + library).c_str(),
                                 [=](benchmark::State& state) { function(state, *workload); })
        ->Unit(benchmark::kMillisecond)
        ->MinTime(0.1);
  };
  for (const char* name : {"ball:1000", "ball:10000", "ball:100000", "ball:1000000", "cube:1000000",
                           "sphere:10000", "sphere:100000", "mesh:stanford-bunny.obj",
                           "mesh:rocker-arm.obj", "mesh:spot.obj", "lattice:50"}) {
    const auto workload = std::make_shared<Workload>(name);
    add("hulld", BuildByHulld, workload);
    add("qhull", BuildByQhull, workload);
    add("cgal", BuildByCgal, workload);
  }
  for (const char* name : {"ball:100000", "sphere:100000"}) {
    add("hulld-one-at-a-time", StreamIntoHulld, std::make_shared<Workload>(name));
  }
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  hulld::bench::Register();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}
