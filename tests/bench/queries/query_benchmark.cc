// Collision queries against FCL, libccd, Bullet, and the textbook's SAT, on the same queries, in
// one process:
//
//   query_benchmark --benchmark_enable_random_interleaving=true --benchmark_repetitions=5
//       --benchmark_filter='^relation/' --benchmark_out=FILE.csv
//
// writes medians (CsvReporter). An iteration answers a block of distinct, independent queries.
// Columns: `queries` in the block; `ns` per query (processor time, real time if several threads
// work); `wrong`, the number of verdicts that differ from hulld's exact relation, which the tests
// check against an independent oracle. `wrong` is omitted in the regime "touch", where a library
// that rounds its rotation receives a different query. Suites:
//
//   relation  hulls at their poses -> colliding or not; "from poses": poses converted to the
//             method's own types each time
//   contact   depth, normal, and witness points of overlapping or touching hulls; `none`: no depth
//             was found
//   distance  distance and witness points of separated hulls
//   motion    the same pairs repeatedly, with a small motion each time, or at rest in contact, or
//             sliding face on face; with and without a cache
//   batch     all queries in one call on 1 or 2 threads; `ns` is real time, `cpu_ns` the processor
//             time of all threads together
//   scene     all colliding pairs among many hulls (scene_benchmark.h)

#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>

#include "core/query/batch.h"
#include "core/query/collision.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/queries/query_method.h"
#include "tests/bench/queries/query_sets.h"
#include "tests/bench/queries/scene_benchmark.h"

namespace hulld::bench {
namespace {

constexpr size_t kQueries = 128;
// Enough relations that a branch predictor cannot learn the block: it learns 128 repeated queries,
// which reduces the apparent time of most methods to two thirds.
constexpr size_t kRelations = 4096;
// Fewer for large hulls: their support points take most of the time, and some peers take
// milliseconds.
constexpr size_t kRelationsOfLarge = 256;

// Queries, created when the first benchmark needs them, and their exact answers.
class Workload {
 public:
  Workload(std::string set, Regime regime, size_t count)
      : set_(std::move(set)), regime_(regime), count_(count) {}

  Regime regime() const { return regime_; }
  const QuerySet& queries() {
    Make();
    return queries_;
  }
  const std::vector<Verdict>& truth() {
    Make();
    return truth_;
  }
  const std::vector<double>& separations() {
    Make();
    for (size_t i = separations_.size(); i < queries_.queries.size(); ++i) {
      const QuerySet::Query& query = queries_.queries[i];
      separations_.push_back(BestSeparation(queries_.hulls[query.hull_a], query.X_WA,
                                            queries_.hulls[query.hull_b], query.X_WB));
    }
    return separations_;
  }

 private:
  void Make() {
    if (made_) return;
    made_ = true;
    queries_ = MakeQuerySet(set_, regime_, count_);
    for (size_t i = 0; i < queries_.a.size(); ++i) {
      const bool apart =
          CheckCollision(queries_.a[i], queries_.b[i])->relation == Relation::kSeparated;
      truth_.push_back(apart ? Verdict::kApart : Verdict::kColliding);
    }
  }

  std::string set_;
  Regime regime_;
  size_t count_;
  bool made_ = false;
  QuerySet queries_;
  std::vector<Verdict> truth_;
  std::vector<double> separations_;
};

// A method and the workload that it is prepared for.
struct Subject {
  std::shared_ptr<Workload> workload;
  std::shared_ptr<QueryMethod> method;
  bool prepared = false;

  bool Prepare(benchmark::State& state) {
    const QuerySet& set = workload->queries();
    if (set.queries.empty()) {
      state.SkipWithError("skipped: no data");
      return false;
    }
    if (!prepared) method->Prepare(set.hulls, set.queries);
    prepared = true;
    return true;
  }
};

void ReportTime(benchmark::State& state, size_t queries) {
  state.counters["queries"] = static_cast<double>(queries);
  // Processor time, except for rows that use real time.
  state.counters["ns"] = benchmark::Counter(
      1e-9 * static_cast<double>(queries),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void ReportWrong(benchmark::State& state, Workload& workload, std::span<const Verdict> verdicts) {
  if (workload.regime() == Regime::kTouch) return;
  const std::vector<Verdict>& truth = workload.truth();
  size_t wrong = 0;
  for (size_t i = 0; i < truth.size(); ++i) wrong += verdicts[i] != truth[i] ? 1 : 0;
  state.counters["wrong"] = static_cast<double>(wrong);
}

template <void (QueryMethod::*kAnswer)(size_t, std::span<Verdict>)>
void FindRelations(benchmark::State& state, Subject& subject) {
  if (!subject.Prepare(state)) return;
  std::vector<Verdict> verdicts(subject.workload->queries().queries.size());
  for (auto _ : state) {
    (subject.method.get()->*kAnswer)(0, verdicts);
    benchmark::DoNotOptimize(verdicts.data());
    benchmark::ClobberMemory();
  }
  ReportTime(state, verdicts.size());
  ReportWrong(state, *subject.workload, verdicts);
}

// `none`: the number of queries without a value from the method. `largest_error` of the values
// found, in the sets' length unit; hulls are about 1 in size, ur5's about 0.1.
void ReportValues(benchmark::State& state, Workload& workload,
                  const std::vector<std::optional<double>>& values) {
  ReportTime(state, values.size());
  const std::vector<double>& truth = workload.separations();
  size_t none = 0;
  double error = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    if (!values[i]) {
      ++none;
    } else {
      error = std::max(error, std::abs(*values[i] - std::abs(truth[i])));
    }
  }
  state.counters["none"] = static_cast<double>(none);
  state.counters["largest_error"] = error;
}

template <void (QueryMethod::*kMeasure)(size_t, std::span<std::optional<double>>)>
void Measure(benchmark::State& state, Subject& subject) {
  if (!subject.Prepare(state)) return;
  std::vector<std::optional<double>> values(subject.workload->queries().queries.size());
  for (auto _ : state) {
    (subject.method.get()->*kMeasure)(0, values);
    benchmark::DoNotOptimize(values.data());
    benchmark::ClobberMemory();
  }
  ReportValues(state, *subject.workload, values);
}

enum class Motion {
  kTurning,  // each frame rotates B by about a milliradian and moves it by about as much
  kSliding,  // each frame moves B in the plane of contact by 2^-10, exactly
  kResting,
};

// Frames of a motion that oscillates, so that it can last as long as the benchmark.
std::vector<std::vector<PlacedHull>> MakeFrames(const QuerySet& set, Motion motion) {
  constexpr int kFrames = 32;
  constexpr double kStep = 1e-3;
  constexpr double kSlide = 0x1p-10;
  std::vector<std::vector<PlacedHull>> frames(kFrames);
  for (int frame = 0; frame < kFrames; ++frame) {
    const int phase = std::abs(kFrames / 2 - frame);
    for (size_t i = 0; i < set.queries.size(); ++i) {
      const QuerySet::Query& query = set.queries[i];
      const QueryHull& b = set.query_hulls[query.hull_b];
      Pose X_WB = query.X_WB;
      if (motion == Motion::kTurning) {
        X_WB.q[i % 4] += kStep * phase;
        X_WB.t[static_cast<Eigen::Index>(i % 3)] += kStep * phase * b.radius();
      } else if (motion == Motion::kSliding) {
        X_WB.t[static_cast<Eigen::Index>(i % 2)] += kSlide * phase;
      }
      frames[frame].push_back(*PlacedHull::Make(b, X_WB));
    }
  }
  return frames;
}

void FollowMotion(benchmark::State& state, Workload& workload, bool warm) {
  const QuerySet& set = workload.queries();
  if (set.queries.empty()) return state.SkipWithError("skipped: no data");
  const bool turns = workload.regime() != Regime::kContact;
  const bool slides = set.name.starts_with("mating:");
  const std::vector<std::vector<PlacedHull>> frames = MakeFrames(set, turns    ? Motion::kTurning
                                                                      : slides ? Motion::kSliding
                                                                               : Motion::kResting);
  std::vector<PairCache> caches(set.queries.size());
  const QueryOptions options;
  for (size_t i = 0; i < caches.size(); ++i) {
    benchmark::DoNotOptimize(CheckCollision(set.a[i], frames.back()[i], options, &caches[i]));
  }
  size_t frame = 0;
  size_t cached = 0;
  size_t answered = 0;
  for (auto _ : state) {
    const std::vector<PlacedHull>& b = frames[frame];
    for (size_t i = 0; i < b.size(); ++i) {
      const auto answer = CheckCollision(set.a[i], b[i], options, warm ? &caches[i] : nullptr);
      cached += answer->rung == Rung::kCached ? 1 : 0;
    }
    answered += b.size();
    frame = (frame + 1) % frames.size();
  }
  ReportTime(state, set.queries.size());
  state.counters["cached_share"] = static_cast<double>(cached) / static_cast<double>(answered);
}

double ProcessSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Answers all queries many times over in one call, as a scene of placements and pairs.
void AnswerBatch(benchmark::State& state, Workload& workload, int threads) {
  constexpr size_t kCopies = 64;
  const QuerySet& set = workload.queries();
  if (set.queries.empty()) return state.SkipWithError("skipped: no data");
  std::vector<PlacedHull> placements = set.a;
  placements.insert(placements.end(), set.b.begin(), set.b.end());
  std::vector<PlacedPair> pairs;
  const auto count = static_cast<uint32_t>(set.a.size());
  for (size_t copy = 0; copy < kCopies; ++copy) {
    for (uint32_t i = 0; i < count; ++i) pairs.push_back({i, count + i});
  }
  const double start = ProcessSeconds();
  for (auto _ : state) {
    const auto answers = CheckCollisions(placements, pairs, {}, threads);
    benchmark::DoNotOptimize(answers.data());
  }
  const double seconds = ProcessSeconds() - start;
  state.counters["cpu_ns"] =
      1e9 * seconds / static_cast<double>(state.iterations()) / static_cast<double>(pairs.size());
  ReportTime(state, pairs.size());
  state.counters["pairs"] = static_cast<double>(pairs.size());
}

std::vector<std::shared_ptr<QueryMethod>> MakeMethods() {
  std::vector<std::shared_ptr<QueryMethod>> methods;
  methods.push_back(MakeHulld());
  for (std::unique_ptr<QueryMethod>& peer : MakePeers()) methods.push_back(std::move(peer));
  return methods;
}

std::string RowName(const std::string& suite, const std::string& set, Regime regime,
                    const std::string& method, const std::string& how = "") {
  return suite + "/" + set + " " + Name(regime) + how + "/" + method;
}

void AddRow(const std::string& name, void (*function)(benchmark::State&, Subject&),
            const std::shared_ptr<Workload>& workload, const std::shared_ptr<QueryMethod>& method) {
  auto subject = std::make_shared<Subject>(Subject{workload, method});
  benchmark::RegisterBenchmark(name.c_str(),
                               [=](benchmark::State& state) { function(state, *subject); })
      ->Unit(benchmark::kMicrosecond)
      ->MinTime(0.01);
}

// The textbook grows with the cube of the size: omitted if a block would take minutes.
bool TextbookTakesTooLong(const std::string& set, Regime regime) {
  if (regime == Regime::kFar) return set == "sphere:10000";
  if (regime == Regime::kClose) return set == "sphere:10000" || set == "sphere:512";
  return set != "sphere:8" && (set != "sphere:64" || regime != Regime::kGap);
}

void RegisterRelations(const std::string& set, Regime regime) {
  const size_t count = set == "sphere:10000" ? kRelationsOfLarge : kRelations;
  const auto workload = std::make_shared<Workload>(set, regime, count);
  std::vector<std::shared_ptr<QueryMethod>> methods = MakeMethods();
  if (!TextbookTakesTooLong(set, regime)) methods.push_back(MakeTextbookInDouble());
  for (const std::shared_ptr<QueryMethod>& method : methods) {
    AddRow(RowName("relation", set, regime, method->name()), FindRelations<&QueryMethod::Answer>,
           workload, method);
    if (set != "sphere:64" && set != "ur5") continue;
    AddRow(RowName("relation", set, regime, method->name(), " from poses"),
           FindRelations<&QueryMethod::AnswerFromPoses>, workload, method);
  }
}

void RegisterMeasures(const std::string& set, Regime regime,
                      const std::shared_ptr<Workload>& workload) {
  const bool deep =
      regime == Regime::kDeep || regime == Regime::kGraze || regime == Regime::kContact;
  const bool apart = regime == Regime::kFar || regime == Regime::kClose || regime == Regime::kGap;
  for (const std::shared_ptr<QueryMethod>& method : MakeMethods()) {
    if (deep && method->knows_depth()) {
      AddRow(RowName("contact", set, regime, method->name()), Measure<&QueryMethod::MeasureDepths>,
             workload, method);
    }
    if (apart && method->knows_distance()) {
      AddRow(RowName("distance", set, regime, method->name()),
             Measure<&QueryMethod::MeasureDistances>, workload, method);
    }
  }
}

void RegisterSequences(const std::string& set, Regime regime,
                       const std::shared_ptr<Workload>& workload) {
  // A motion leaves contact immediately.
  const bool is_left_at_once = regime == Regime::kTouch || regime == Regime::kGraze;
  for (const bool warm : {true, false}) {
    if (is_left_at_once) break;
    benchmark::RegisterBenchmark(
        RowName("motion", set, regime, "hulld", warm ? " warm" : " cold").c_str(),
        [=](benchmark::State& state) { FollowMotion(state, *workload, warm); })
        ->Unit(benchmark::kMicrosecond)
        ->MinTime(0.01);
  }
  if (regime != Regime::kClose && regime != Regime::kDeep) return;
  for (const int threads : {1, 2}) {
    benchmark::RegisterBenchmark(
        RowName("batch", set, regime, "hulld", threads == 1 ? " 1 thread" : " 2 threads").c_str(),
        [=](benchmark::State& state) { AnswerBatch(state, *workload, threads); })
        ->Unit(benchmark::kMillisecond)
        ->MinTime(0.1)
        ->UseRealTime();
  }
}

void Register() {
  for (const char* set : {"sphere:8", "sphere:64", "sphere:512", "sphere:10000", "ur5"}) {
    for (const Regime regime : kRegimes) {
      RegisterRelations(set, regime);
      const auto workload = std::make_shared<Workload>(set, regime, kQueries);
      RegisterMeasures(set, regime, workload);
      RegisterSequences(set, regime, workload);
    }
  }
  for (const char* set : {"mating:8", "mating:64"}) {
    RegisterRelations(set, Regime::kContact);
    RegisterSequences(set, Regime::kContact,
                      std::make_shared<Workload>(set, Regime::kContact, kQueries));
  }
  RegisterScenes();
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  hulld::bench::Register();
  return hulld::bench::RunBenchmarks(argc, argv);
}
