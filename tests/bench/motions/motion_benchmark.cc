// First contacts of motions against FCL, Bullet, and sampling, on the same motions, in one process:
//
//   motion_benchmark --benchmark_enable_random_interleaving=true --benchmark_repetitions=5
//       --benchmark_out=FILE.csv
//
// writes medians (CsvReporter). An iteration answers all motions of a set. Columns: `queries` in
// the set, `ns` per motion (processor time), and, compared with FindTruth on the method's own path:
// `missed` contacts, `false_contacts`, motions left `open`, the largest `time_error` of a contact,
// and its widest `bracket`.
//
// Rows "static:V gap" are hulld's static query of pairs 1e-6 apart, as many as motions in a set.
// Rows "scene:1000" are all contacts of 1000 boxes that move and turn, and with "first" the first
// contact alone (FindCollisions with first_only); queries are pairs whose boxes may meet.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/swept_box.h"
#include "core/query/scene/scene.h"
#include "tests/bench/bench_random.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/motions/motion_methods.h"
#include "tests/bench/motions/motion_sets.h"
#include "tests/bench/motions/motion_truth.h"
#include "tests/bench/queries/query_method.h"
#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {
namespace {

constexpr int kSizes[] = {8, 64, 512, 10000};

// Fewer for large hulls, some of whose rows take milliseconds per motion.
size_t QueriesFor(int vertices) { return vertices > 5000 ? 32 : 128; }

std::shared_ptr<const QuerySet> HullsOf(int vertices) {
  static std::map<int, std::shared_ptr<const QuerySet>> sets;
  std::shared_ptr<const QuerySet>& set = sets[vertices];
  if (!set) {
    set = std::make_shared<QuerySet>(
        MakeQuerySet("sphere:" + std::to_string(vertices), Regime::kFar, 0));
  }
  return set;
}

// Motions and their truth, computed when the first benchmark needs them.
class MotionWorkload {
 public:
  MotionWorkload(int vertices, bool turns, Passage passage)
      : vertices_(vertices), turns_(turns), passage_(passage) {}

  const MotionSet& motions() {
    if (motions_.queries.empty()) {
      motions_ = MakeMotionSet(HullsOf(vertices_), turns_, passage_, QueriesFor(vertices_));
    }
    return motions_;
  }
  const std::vector<MotionTruth>& truth(Path path) {
    // For a translation, both paths are the same.
    if (!turns_) path = Path::kLinear;
    std::vector<MotionTruth>& truth = truth_[path];
    if (truth.empty()) truth = FindTruth(motions(), path);
    return truth;
  }

 private:
  int vertices_;
  bool turns_;
  Passage passage_;
  MotionSet motions_;
  std::map<Path, std::vector<MotionTruth>> truth_;
};

void ReportTimePer(benchmark::State& state, size_t queries) {
  state.counters["queries"] = static_cast<double>(queries);
  state.counters["ns"] = benchmark::Counter(
      1e-9 * static_cast<double>(queries),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void ReportFaults(benchmark::State& state, const std::vector<MotionTruth>& truth,
                  const std::vector<Impact>& impacts) {
  double missed = 0;
  double invented = 0;
  double open = 0;
  double error = 0;
  double bracket = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const Impact& impact = impacts[i];
    if (impact.verdict == Impact::Verdict::kOpen) ++open;
    if (!truth[i].meets) continue;
    if (*truth[i].meets && impact.verdict == Impact::Verdict::kApart) ++missed;
    if (!*truth[i].meets && impact.verdict == Impact::Verdict::kMeets) ++invented;
    if (!*truth[i].meets || impact.verdict != Impact::Verdict::kMeets) continue;
    error = std::max(
        {error, truth[i].separated_until - impact.time, impact.time - truth[i].contact_time});
    bracket = std::max(bracket, impact.bracket);
  }
  state.counters["missed"] = missed;
  state.counters["false_contacts"] = invented;
  state.counters["open"] = open;
  state.counters["time_error"] = error;
  state.counters["bracket"] = bracket;
}

void FindImpacts(benchmark::State& state, MotionWorkload& workload, MotionMethod& method,
                 bool& prepared) {
  const MotionSet& set = workload.motions();
  const std::vector<MotionTruth>& truth = workload.truth(method.path());
  if (!prepared) method.Prepare(set);
  prepared = true;
  std::vector<Impact> impacts(set.queries.size());
  for (auto _ : state) {
    for (size_t i = 0; i < impacts.size(); ++i) impacts[i] = method.Find(i);
    benchmark::DoNotOptimize(impacts.data());
    benchmark::ClobberMemory();
  }
  ReportTimePer(state, impacts.size());
  ReportFaults(state, truth, impacts);
}

void Register(int vertices, bool turns, Passage passage) {
  const auto workload = std::make_shared<MotionWorkload>(vertices, turns, passage);
  std::vector<std::shared_ptr<MotionMethod>> methods = {MakeHulldMotion("hulld")};
  for (auto& peer : MakePeerMotions(turns)) methods.push_back(std::move(peer));
  for (const int poses : {10, 100, 1000}) methods.push_back(MakeSampling(poses));
  for (const auto& [name, resolution] :
       {std::pair("hulld 1e-2", 1e-2), {"hulld 1e-4", 1e-4}, {"hulld 1e-6", 1e-6}}) {
    if (turns) methods.push_back(MakeHulldMotion(name, resolution));
  }
  for (const std::shared_ptr<MotionMethod>& method : methods) {
    const auto prepared = std::make_shared<bool>(false);
    const std::string name = std::string("motions/") + (turns ? "rotation:" : "translation:") +
                             std::to_string(vertices) + " " + Name(passage) + "/" + method->name();
    benchmark::RegisterBenchmark(
        name.c_str(),
        [=](benchmark::State& state) { FindImpacts(state, *workload, *method, *prepared); })
        ->Unit(benchmark::kMicrosecond)
        ->MinTime(0.01);
  }
}

void RegisterStatic(int vertices) {
  struct Subject {
    QuerySet set;
    std::unique_ptr<QueryMethod> method;
    std::vector<Verdict> verdicts;
  };
  const auto subject = std::make_shared<Subject>();
  benchmark::RegisterBenchmark(
      ("motions/static:" + std::to_string(vertices) + " gap/hulld").c_str(),
      [=](benchmark::State& state) {
        if (!subject->method) {
          subject->set = MakeQuerySet("sphere:" + std::to_string(vertices), Regime::kGap,
                                      QueriesFor(vertices));
          subject->method = MakeHulld();
          subject->method->Prepare(subject->set.hulls, subject->set.queries);
          subject->verdicts.resize(subject->set.queries.size());
        }
        for (auto _ : state) {
          subject->method->Answer(0, subject->verdicts);
          benchmark::DoNotOptimize(subject->verdicts.data());
          benchmark::ClobberMemory();
        }
        ReportTimePer(state, subject->verdicts.size());
      })
      ->Unit(benchmark::kMicrosecond)
      ->MinTime(0.01);
}

// Boxes on a lattice, apart at the start.
class MovingScene {
 public:
  MovingScene() {
    HullBuilder builder;
    std::vector<Vector> corners;
    for (int i = 0; i < 8; ++i)
      corners.push_back({i & 1 ? 1.0 : -1, i & 2 ? 0.5 : -0.5, i & 4 ? 0.7 : -0.7});
    if (!builder.Add(corners).ok()) std::abort();
    hull_ = builder.Snapshot();
    box_.emplace(hull_);
    Random random(20261128);
    for (int i = 0; i < 1000; ++i) {
      const Pose start = {random.Rotation(), 4 * Vector(i % 10, i / 10 % 10, i / 100)};
      const Pose end = {Turned(start.q, random.UnitVector()), start.t + 10 * random.UnitVector()};
      moving_.push_back({*box_, {start, end}});
      placed_.emplace_back(*box_, start);
      swept_.push_back(MovingBoxOf(moving_.back()));
    }
  }

  // Returns the number of candidates.
  size_t FindContacts(bool first_only) const {
    const SceneOptions options;
    const SceneSearch scene = *SceneSearch::Make(placed_, options, swept_);
    MotionOptions motion;
    SceneCandidates candidates;
    size_t count = 0;
    for (uint32_t a = 0; a < scene.size(); ++a) {
      candidates.Start(scene, a);
      while (!candidates.Gather(1000)) {
      }
      while (const std::optional<uint32_t> b = candidates.Next()) {
        ++count;
        if (!scene.MayMeet(a, *b, motion.latest)) continue;
        const FirstContact contact = *FindFirstContact(moving_[a], moving_[*b], motion);
        if (first_only) motion.latest = std::min(motion.latest, contact.contact_time.value_or(1));
      }
    }
    return count;
  }

 private:
  Hull hull_;
  std::optional<QueryHull> box_;
  std::vector<MovingHull> moving_;
  std::vector<PlacedHull> placed_;
  std::vector<MovingBox> swept_;
};

void RegisterScene() {
  for (const bool first_only : {false, true}) {
    benchmark::RegisterBenchmark(
        first_only ? "motions/scene:1000 first/hulld" : "motions/scene:1000/hulld",
        [=](benchmark::State& state) {
          static const MovingScene scene;
          size_t candidates = 0;
          for (auto _ : state) candidates = scene.FindContacts(first_only);
          ReportTimePer(state, candidates);
        })
        ->Unit(benchmark::kMicrosecond);
  }
}

void RegisterAll() {
  for (const int vertices : kSizes) {
    // First, because the first row names the columns.
    for (const bool turns : {false, true}) {
      for (const Passage passage : kPassages) Register(vertices, turns, passage);
    }
    RegisterStatic(vertices);
  }
  RegisterScene();
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  hulld::bench::RegisterAll();
  return hulld::bench::RunBenchmarks(argc, argv);
}
