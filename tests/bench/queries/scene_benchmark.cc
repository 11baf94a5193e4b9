#include "tests/bench/queries/scene_benchmark.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/query/scene/scene.h"
#include "tests/bench/bench_random.h"
#include "tests/bench/queries/fcl_scene.h"
#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {
namespace {

constexpr size_t kFrames = 4;

class SceneWorkload {
 public:
  SceneWorkload(std::string set, size_t count) : set_(std::move(set)), count_(count) {}

  // Returns false if the set has no data.
  bool Make() {
    if (!made_) {
      made_ = true;
      hulls_ = MakeQuerySet(set_, Regime::kFar, 0);
      if (!hulls_.hulls.empty()) MakeFrames();
    }
    return !hulls_.hulls.empty();
  }
  const QuerySet& hulls() const { return hulls_; }
  const std::vector<size_t>& hull_of() const { return hull_of_; }
  const std::vector<Pose>& frame(size_t i) const { return frames_[i % kFrames]; }

  size_t CountByHulld(size_t frame) const {
    std::vector<PlacedHull> placements;
    placements.reserve(hull_of_.size());
    for (size_t i = 0; i < hull_of_.size(); ++i) {
      placements.push_back(
          *PlacedHull::Make(hulls_.query_hulls[hull_of_[i]], this->frame(frame)[i]));
    }
    const absl::StatusOr<SceneTotals> totals = FindCollisions(placements, {}, [](auto) {});
    return totals.ok() ? totals->found : 0;
  }

 private:
  void MakeFrames() {
    constexpr uint64_t kSeed = 20261121;
    constexpr double kStep = 0.05;
    Random random(kSeed);
    double radii = 0;
    for (size_t i = 0; i < count_; ++i) {
      hull_of_.push_back(random.Below(hulls_.hulls.size()));
      radii += hulls_.query_hulls[hull_of_.back()].radius();
    }
    const double radius = radii / static_cast<double>(count_);
    // About three radii of room for each.
    const double half = 1.5 * radius * std::cbrt(static_cast<double>(count_));
    std::vector<Pose> poses(count_);
    for (Pose& pose : poses) {
      pose.q = random.Rotation();
      for (int k = 0; k < 3; ++k) pose.t[k] = random.Between(-half, half);
    }
    for (size_t frame = 0; frame < kFrames; ++frame) {
      for (Pose& pose : poses) {
        pose.t += kStep * radius * random.UnitVector();
        pose.q[random.Below(4)] += kStep;
      }
      frames_.push_back(poses);
    }
  }

  std::string set_;
  size_t count_;
  bool made_ = false;
  QuerySet hulls_;
  std::vector<size_t> hull_of_;
  std::vector<std::vector<Pose>> frames_;
};

template <typename Count>
void RunScene(benchmark::State& state, SceneWorkload& scene, Count count) {
  size_t frame = 0;
  for (auto _ : state) benchmark::DoNotOptimize(count(frame++));
  const size_t found = count(0);
  const size_t truth = scene.CountByHulld(0);
  state.counters["ns"] = benchmark::Counter(
      1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["queries"] = static_cast<double>(scene.hull_of().size());
  state.counters["pairs"] = static_cast<double>(found);
  state.counters["wrong"] = std::abs(static_cast<double>(found) - static_cast<double>(truth));
}

void RunHulld(benchmark::State& state, SceneWorkload& scene) {
  if (!scene.Make()) return state.SkipWithError("skipped: no data");
  RunScene(state, scene, [&](size_t frame) { return scene.CountByHulld(frame); });
}

#ifdef HULLD_HAVE_FCL
void RunFcl(benchmark::State& state, SceneWorkload& scene) {
  if (!scene.Make()) return state.SkipWithError("skipped: no data");
  FclScene fcl(scene.hulls().hulls, scene.hull_of());
  RunScene(state, scene, [&](size_t frame) { return fcl.CountCollisions(scene.frame(frame)); });
}
#endif

void AddRow(const std::string& name, void (*function)(benchmark::State&, SceneWorkload&),
            const std::shared_ptr<SceneWorkload>& scene) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [=](benchmark::State& state) { function(state, *scene); })
      ->Unit(benchmark::kMillisecond)
      ->MinTime(0.05);
}

}  // namespace

void RegisterScenes() {
  for (const char* set : {"sphere:64", "ur5"}) {
    for (const size_t count : {size_t{1000}, size_t{10000}}) {
      const auto scene = std::make_shared<SceneWorkload>(set, count);
      const std::string name = "scene/" + std::to_string(count) + " of " + std::string(set) + "/";
      AddRow(name + "hulld", RunHulld, scene);
#ifdef HULLD_HAVE_FCL
      AddRow(name + "FCL tree", RunFcl, scene);
#endif
    }
  }
}

}  // namespace hulld::bench
