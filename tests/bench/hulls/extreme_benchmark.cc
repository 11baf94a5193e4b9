// Cost of each extreme of tests/core/checks/extreme_clouds.h, relative to an easy cloud with as
// many points and a hull with as many vertices:
//
//   extreme_benchmark --benchmark_out=FILE
//
// Both are built alternately; times are CPU time, medians. If the order forces a quadratic number
// of facets, the row includes the time per facet created. The signs decided by each stage of exact
// arithmetic are counts of a single build.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <memory>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "core/numeric/orientation.h"
#include "tests/bench/csv_reporter.h"
#include "tests/core/checks/extreme_clouds.h"

namespace hulld::bench {
namespace {

constexpr int kPoints = 10000;
constexpr int kQuadraticPoints = 2000;
constexpr int kTurns = 5;

double ThreadSeconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

HullBuilder BuildAtOnce(const std::vector<Vector>& points) {
  HullBuilder builder;
  benchmark::DoNotOptimize(builder.Add(points).ok());
  return builder;
}

HullBuilder BuildOneByOne(const std::vector<Vector>& points) {
  HullBuilder builder;
  for (const Vector& p : points) benchmark::DoNotOptimize(builder.Add(std::span(&p, 1)).ok());
  return builder;
}

using Build = HullBuilder (*)(const std::vector<Vector>&);

// Returns the seconds of a build; measures several if one is too short.
double SecondsOf(Build build, const std::vector<Vector>& points) {
  int builds = 0;
  const double start = ThreadSeconds();
  double seconds = 0;
  while (seconds < 0.01) {
    benchmark::DoNotOptimize(build(points));
    ++builds;
    seconds = ThreadSeconds() - start;
  }
  return seconds / builds;
}

double MedianOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void CountSigns(benchmark::State& state, Build build, const std::vector<Vector>& points) {
  const OrientationCounts before = ThreadOrientationCounts();
  benchmark::DoNotOptimize(build(points));
  const OrientationCounts after = ThreadOrientationCounts();
  state.counters["filter_signs"] = static_cast<double>(after.filter + after.nearest_filter -
                                                       before.filter - before.nearest_filter);
  state.counters["fixed_point_signs"] = static_cast<double>(after.fixed_point - before.fixed_point);
  state.counters["expansion_signs"] = static_cast<double>(after.expansion - before.expansion);
  state.counters["integer_signs"] = static_cast<double>(after.integer - before.integer);
}

void Measure(benchmark::State& state, const Extreme& extreme, Build build) {
  const bool is_quadratic = extreme.facets_one_by_one != nullptr;
  const int n = is_quadratic ? kQuadraticPoints : kPoints;
  const std::vector<Vector> points = extreme.make(n);
  const Hull hull = BuildAtOnce(points).Snapshot();
  if (!AuditHull(hull).ok()) return state.SkipWithError("the audit failed");
  const std::vector<Vector> generic =
      GenericCloud(static_cast<int>(points.size()), static_cast<int>(hull.vertices().size()));

  std::vector<double> own;
  std::vector<double> of_generic;
  for (int turn = 0; turn < kTurns; ++turn) {
    own.push_back(SecondsOf(build, points));
    of_generic.push_back(SecondsOf(build, generic));
  }
  const double seconds = MedianOf(own);
  for (auto _ : state) state.SetIterationTime(seconds);
  state.counters["points"] = static_cast<double>(points.size());
  state.counters["vertices"] = static_cast<double>(hull.vertices().size());
  state.counters["times_generic"] = seconds / MedianOf(of_generic);
  state.counters["ns_per_facet"] =
      is_quadratic && build == BuildOneByOne
          ? 1e9 * seconds / static_cast<double>(extreme.facets_one_by_one(n))
          : 0;
  CountSigns(state, build, points);
}

void Register() {
  for (const Extreme& extreme : Extremes()) {
    const auto add = [&](const std::string& library, Build build) {
      benchmark::RegisterBenchmark(
          ("extreme/" + extreme.name + "/" + library).c_str(),
          [&extreme, build](benchmark::State& state) { Measure(state, extreme, build); })
          ->Unit(benchmark::kMillisecond)
          ->UseManualTime()
          ->Iterations(1);
    };
    add("hulld", BuildAtOnce);
    add("hulld one at a time", BuildOneByOne);
  }
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  hulld::bench::Register();
  return hulld::bench::RunBenchmarks(argc, argv);
}
