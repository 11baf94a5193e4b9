// Workloads of single pairs, batches, streams, and scenes.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <span>
#include <thread>
#include <tuple>

#include "core/query/batch.h"
#include "core/query/collision.h"
#include "core/query/scene/scene.h"
#include "tests/bench/bench_random.h"
#include "tests/bench/queries/query_sets.h"
#include "tests/bench/service/remote_subject.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kThreads = 2;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void FillPose(const Pose& pose, v1::Pose* message) {
  message->mutable_rotation()->set_w(pose.q[0]);
  message->mutable_rotation()->set_x(pose.q[1]);
  message->mutable_rotation()->set_y(pose.q[2]);
  message->mutable_rotation()->set_z(pose.q[3]);
  message->mutable_translation()->set_x(pose.t[0]);
  message->mutable_translation()->set_y(pose.t[1]);
  message->mutable_translation()->set_z(pose.t[2]);
}

void FillPlacement(size_t hull, const Pose& pose, v1::Placement* message) {
  message->set_hull_id(Ur5Id(hull));
  FillPose(pose, message->mutable_pose());
}

// Adds a pose to an update or to packed placements.
template <typename Poses>
void AddPose(const Pose& pose, Poses* message) {
  for (const double number : pose.q) message->add_poses(number);
  for (int k = 0; k < 3; ++k) message->add_poses(pose.t[k]);
}

// Encoding of placements.
enum class Form { kList, kPacked };

template <typename Request>
void AddPlacement(Form form, size_t hull, const Pose& pose, Request* request) {
  if (form == Form::kList) return FillPlacement(hull, pose, request->add_placements());
  v1::PackedPlacements* const packed = request->mutable_packed_placements();
  while (static_cast<size_t>(packed->hull_ids_size()) <= hull) {
    packed->add_hull_ids(Ur5Id(packed->hull_ids_size()));
  }
  packed->add_hulls(static_cast<uint32_t>(hull));
  AddPose(pose, packed);
}

Sample Summarize(std::vector<double> call_us, double seconds, double per_call) {
  std::sort(call_us.begin(), call_us.end());
  const auto at = [&](double share) {
    return call_us[static_cast<size_t>(share * static_cast<double>(call_us.size() - 1))];
  };
  return {per_call * static_cast<double>(call_us.size()) / seconds, at(0.5), at(0.99)};
}

// Calls `call` repeatedly on `clients` threads, with the number of the thread.
Sample Repeat(int clients, double seconds, double per_call,
              const std::function<void(int client, size_t i)>& call) {
  std::vector<std::vector<double>> call_us(clients);
  const auto start = Clock::now();
  std::vector<std::jthread> threads;
  for (int client = 0; client < clients; ++client) {
    threads.emplace_back([&, client] {
      for (size_t i = 0; i == 0 || SecondsSince(start) < seconds; ++i) {
        const auto begin = Clock::now();
        call(client, i);
        call_us[client].push_back(1e6 * SecondsSince(begin));
      }
    });
  }
  threads.clear();
  std::vector<double> all;
  for (const std::vector<double>& each : call_us) all.insert(all.end(), each.begin(), each.end());
  return Summarize(std::move(all), SecondsSince(start), per_call);
}

const QuerySet& Ur5Queries(Regime regime, size_t count) {
  static std::map<std::pair<Regime, size_t>, QuerySet> sets;
  const auto [found, is_new] = sets.try_emplace({regime, count});
  if (is_new) found->second = MakeQuerySet("ur5", regime, count);
  if (found->second.queries.empty()) {
    std::fprintf(stderr, "remote_benchmark: there is no ur5 in HULLD_DATA\n");
    std::exit(1);
  }
  return found->second;
}

// Hulls and their poses.
struct Placements {
  std::vector<const QueryHull*> hulls;
  std::vector<Pose> poses;

  void Add(const QueryHull& hull, const Pose& pose) {
    hulls.push_back(&hull);
    poses.push_back(pose);
  }
};

// Places all hulls again on all threads, like a program with moving hulls. Requires: `placed` has
// the same size; its memory is reused.
void PlaceAll(const Placements& placements, std::vector<PlacedHull>& placed) {
#pragma omp parallel for schedule(static) num_threads(kThreads)
  for (size_t i = 0; i < placed.size(); ++i) {
    absl::StatusOr<PlacedHull> made = PlacedHull::Make(*placements.hulls[i], placements.poses[i]);
    CheckOk(made.status(), "a pose");
    placed[i] = *std::move(made);
  }
}

// Pairs of placements, for core and for the wire.
struct Batch {
  Placements placements;
  std::vector<PlacedHull> placed;
  std::vector<PlacedPair> pairs;
  v1::BatchCheckCollisionsRequest request;
};

// Makes `count` pairs by repeating `distinct` queries of a regime.
std::shared_ptr<Batch> MakeBatch(Regime regime, size_t distinct, size_t count,
                                 Form form = Form::kList) {
  const QuerySet& set = Ur5Queries(regime, distinct);
  auto batch = std::make_shared<Batch>();
  batch->placed = set.a;
  batch->placed.insert(batch->placed.end(), set.b.begin(), set.b.end());
  for (const QuerySet::Query& query : set.queries) {
    AddPlacement(form, query.hull_a, query.X_WA, &batch->request);
    batch->placements.Add(set.query_hulls[query.hull_a], query.X_WA);
  }
  for (const QuerySet::Query& query : set.queries) {
    AddPlacement(form, query.hull_b, query.X_WB, &batch->request);
    batch->placements.Add(set.query_hulls[query.hull_b], query.X_WB);
  }
  for (size_t i = 0; i < count; ++i) {
    const auto a = static_cast<uint32_t>(i % distinct);
    const auto b = static_cast<uint32_t>(distinct) + a;
    batch->pairs.push_back({a, b});
    batch->request.add_pairs(a);
    batch->request.add_pairs(b);
  }
  return batch;
}

Sample AnswerBatch(RemoteSubject& subject, const Batch& batch, double seconds) {
  PutUr5(subject);
  return Repeat(1, seconds, static_cast<double>(batch.pairs.size()), [&](int, size_t) {
    size_t answered = 0;
    grpc::ClientContext context;
    const auto reader = subject.stub(0).BatchCheckCollisions(&context, batch.request);
    for (v1::BatchCheckCollisionsResponse part; reader->Read(&part);) {
      answered += part.columns().relations_size();
    }
    CheckOk(reader->Finish(), "a batch");
    if (answered != batch.pairs.size()) CheckOk(absl::InternalError("too few"), "a batch");
  });
}

Sample AnswerBatchInProcess(const Batch& batch, double seconds) {
  return Repeat(1, seconds, static_cast<double>(batch.pairs.size()), [&](int, size_t) {
    CheckOk(CheckCollisions(batch.placed, batch.pairs, {}, kThreads).back().status(), "a batch");
  });
}

Sample PlaceAndAnswerBatch(const Batch& batch, double seconds) {
  std::vector<PlacedHull> placed = batch.placed;
  return Repeat(1, seconds, static_cast<double>(batch.pairs.size()), [&](int, size_t) {
    PlaceAll(batch.placements, placed);
    CheckOk(CheckCollisions(placed, batch.pairs, {}, kThreads).back().status(), "a batch");
  });
}

// `count` links of arms at random poses, and one stream that moves them all at each step.
struct Motion {
  v1::CollisionStreamOpen open;
  std::vector<v1::CollisionStreamUpdate> frames;
  // Data for core: the first placement of each pair, the hull of the second, and its poses.
  std::vector<PlacedHull> first;
  std::vector<const QueryHull*> second;
  std::vector<std::vector<Pose>> poses;
};

std::shared_ptr<Motion> MakeMotion(size_t count) {
  constexpr size_t kFrames = 16;
  constexpr double kStep = 1e-3;
  const QuerySet& set = Ur5Queries(Regime::kClose, count);
  auto motion = std::make_shared<Motion>();
  for (size_t i = 0; i < count; ++i) {
    const QuerySet::Query& query = set.queries[i];
    FillPlacement(query.hull_a, query.X_WA, motion->open.add_placements());
    FillPlacement(query.hull_b, query.X_WB, motion->open.add_placements());
    motion->first.push_back(set.a[i]);
    motion->second.push_back(&set.b[i].query_hull());
    motion->open.add_pairs(static_cast<uint32_t>(2 * i));
    motion->open.add_pairs(static_cast<uint32_t>(2 * i + 1));
  }
  for (size_t frame = 0; frame < kFrames; ++frame) {
    v1::CollisionStreamUpdate& update = motion->frames.emplace_back();
    std::vector<Pose>& poses = motion->poses.emplace_back();
    const double phase =
        kStep * std::abs(static_cast<double>(kFrames / 2) - static_cast<double>(frame));
    for (size_t i = 0; i < count; ++i) {
      Pose X_WB = set.queries[i].X_WB;
      X_WB.q[i % 4] += phase;
      update.add_placements(static_cast<uint32_t>(2 * i + 1));
      AddPose(X_WB, &update);
      poses.push_back(X_WB);
    }
  }
  return motion;
}

Sample FollowMotion(RemoteSubject& subject, const Motion& motion, double seconds) {
  PutUr5(subject);
  const auto stream = subject.client().OpenCollisionStream();
  CheckOk(stream->Open(motion.open).status(), "opening a stream");
  const double pairs = motion.open.pairs_size() / 2.0;
  const Sample sample = Repeat(1, seconds, pairs, [&](int, size_t i) {
    const auto answer = stream->Update(motion.frames[i % motion.frames.size()]);
    CheckOk(answer.status(), "an update");
    if (answer->pairs_size() != pairs) CheckOk(absl::InternalError("too few"), "an update");
  });
  CheckOk(stream->Close(), "closing a stream");
  return sample;
}

// Follows the motion with core: each pair uses the cache of its last query.
Sample FollowMotionInProcess(const Motion& motion, double seconds) {
  const auto count = static_cast<int64_t>(motion.first.size());
  std::vector<PairCache> caches(motion.first.size());
  std::vector<Relation> relations(motion.first.size());
  return Repeat(1, seconds, static_cast<double>(count), [&](int, size_t step) {
    const std::vector<Pose>& poses = motion.poses[step % motion.poses.size()];
#pragma omp parallel for schedule(dynamic, 16) num_threads(kThreads)
    for (int64_t i = 0; i < count; ++i) {
      const auto b = PlacedHull::Make(*motion.second[i], poses[i]);
      CheckOk(b.status(), "a pose");
      const auto answer = CheckCollision(motion.first[i], *b, {}, &caches[i]);
      CheckOk(answer.status(), "a pair");
      relations[i] = answer->relation;
    }
  });
}

struct Scene {
  Placements placements;
  std::vector<PlacedHull> placed;
  v1::FindCollisionsRequest request;
  size_t found = 0;
};

// About three radii of room for each of `count` links.
std::shared_ptr<Scene> MakeScene(size_t count, Form form) {
  const QuerySet& hulls = Ur5Queries(Regime::kFar, 1);
  Random random(20261121);
  auto scene = std::make_shared<Scene>();
  double radii = 0;
  for (const QueryHull& hull : hulls.query_hulls) radii += hull.radius();
  const double radius = radii / static_cast<double>(hulls.query_hulls.size());
  const double half = 1.5 * radius * std::cbrt(static_cast<double>(count));
  for (size_t i = 0; i < count; ++i) {
    const size_t hull = random.Below(hulls.hulls.size());
    Pose pose;
    pose.q = random.Rotation();
    for (int k = 0; k < 3; ++k) pose.t[k] = random.Between(-half, half);
    AddPlacement(form, hull, pose, &scene->request);
    scene->placements.Add(hulls.query_hulls[hull], pose);
    scene->placed.push_back(*PlacedHull::Make(hulls.query_hulls[hull], pose));
  }
  SceneOptions options;
  options.threads = kThreads;
  const auto totals = FindCollisions(scene->placed, options, [](auto) {});
  CheckOk(totals.status(), "a scene");
  scene->found = totals->found;
  return scene;
}

Sample SearchScene(RemoteSubject& subject, const Scene& scene, double seconds) {
  PutUr5(subject);
  return Repeat(1, seconds, 1, [&](int, size_t) {
    size_t found = 0;
    grpc::ClientContext context;
    context.AddMetadata("floor-found", std::to_string(scene.found));
    const auto reader = subject.stub(0).FindCollisions(&context, scene.request);
    for (v1::FindCollisionsResponse part; reader->Read(&part);) found += part.pairs_size() / 2;
    CheckOk(reader->Finish(), "a scene");
    if (found != scene.found) CheckOk(absl::InternalError("wrong number"), "a scene");
  });
}

void SearchInProcess(std::span<const PlacedHull> placed) {
  SceneOptions options;
  options.threads = kThreads;
  CheckOk(FindCollisions(placed, options, [](auto) {}).status(), "a scene");
}

}  // namespace

std::vector<RemoteWorkload> MakeCheckWorkloads(double seconds) {
  constexpr size_t kQueries = 128;
  auto requests = std::make_shared<std::vector<v1::CheckCollisionRequest>>(kQueries);
  const QuerySet& set = Ur5Queries(Regime::kClose, kQueries);
  for (size_t i = 0; i < kQueries; ++i) {
    const QuerySet::Query& query = set.queries[i];
    FillPlacement(query.hull_a, query.X_WA, (*requests)[i].mutable_a());
    FillPlacement(query.hull_b, query.X_WB, (*requests)[i].mutable_b());
  }
  std::vector<RemoteWorkload> workloads;
  for (const int clients : {1, 8}) {
    const auto run = [=](RemoteSubject& subject) {
      PutUr5(subject);
      for (int i = 0; i < clients; ++i) subject.stub(i);
      return Repeat(clients, seconds, 1, [&](int client, size_t i) {
        grpc::ClientContext context;
        v1::CheckCollisionResponse response;
        CheckOk(subject.stub(client).CheckCollision(&context, (*requests)[i % kQueries], &response),
                "a check");
      });
    };
    workloads.push_back(
        {"check " + std::to_string(clients) + (clients == 1 ? " client" : " clients"), "calls", run,
         nullptr});
  }
  return workloads;
}

std::vector<RemoteWorkload> MakeBatchWorkloads(double seconds) {
  constexpr size_t kPairs = size_t{1} << 18;
  constexpr size_t kOwnPairs = size_t{1} << 14;
  std::vector<RemoteWorkload> workloads;
  const auto add = [&](const std::string& name, const std::shared_ptr<Batch>& batch) {
    RemoteWorkload workload = {
        name, "pairs",
        [=](RemoteSubject& subject) { return AnswerBatch(subject, *batch, seconds); },
        [=] { return AnswerBatchInProcess(*batch, seconds); }};
    // Each pair has its own placements.
    if (batch->pairs.size() * 2 == batch->placed.size()) {
      workload.run_placing = [=] { return PlaceAndAnswerBatch(*batch, seconds); };
    }
    workloads.push_back(std::move(workload));
  };
  add("batch ur5 close", MakeBatch(Regime::kClose, 128, kPairs));
  add("batch ur5 deep", MakeBatch(Regime::kDeep, 128, kPairs));
  add("batch ur5 close, two placements a pair", MakeBatch(Regime::kClose, kOwnPairs, kOwnPairs));
  add("batch ur5 close, two packed placements a pair",
      MakeBatch(Regime::kClose, kOwnPairs, kOwnPairs, Form::kPacked));
  return workloads;
}

std::vector<RemoteWorkload> MakeStreamWorkloads(double seconds) {
  std::vector<RemoteWorkload> workloads;
  for (const size_t count : {size_t{1}, size_t{1024}}) {
    const std::shared_ptr<Motion> motion = MakeMotion(count);
    workloads.push_back(
        {"stream " + std::to_string(count) + (count == 1 ? " pair" : " pairs"), "pairs",
         [=](RemoteSubject& subject) { return FollowMotion(subject, *motion, seconds); },
         [=] { return FollowMotionInProcess(*motion, seconds); }});
  }
  return workloads;
}

std::vector<RemoteWorkload> MakeSceneWorkloads(double seconds) {
  std::vector<RemoteWorkload> workloads;
  const std::tuple<size_t, Form, const char*> scenes[] = {
      {1000, Form::kList, ""}, {10000, Form::kList, ""}, {10000, Form::kPacked, ", packed"}};
  for (const auto& [count, form, suffix] : scenes) {
    const std::shared_ptr<Scene> scene = MakeScene(count, form);
    workloads.push_back(
        {"scene " + std::to_string(count) + " ur5 links" + suffix, "calls",
         [=](RemoteSubject& subject) { return SearchScene(subject, *scene, seconds); },
         [=] {
           return Repeat(1, seconds, 1, [&](int, size_t) { SearchInProcess(scene->placed); });
         },
         [=] {
           std::vector<PlacedHull> placed = scene->placed;
           return Repeat(1, seconds, 1, [&](int, size_t) {
             PlaceAll(scene->placements, placed);
             SearchInProcess(placed);
           });
         }});
  }
  return workloads;
}

}  // namespace hulld::bench
