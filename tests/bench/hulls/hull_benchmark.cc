// Hull building compared with qhull and CGAL, on the same points, in one process. Four suites, each
// with its own columns:
//
//   build     whole clouds in one call
//   snapshot  canonical snapshots, compared with building their hulls
//   stream    points one by one, each in a separate call: the total, and percentiles of the latency
//   cost      build and stream against the number of points
//
// tests/bench/hulls/run_hull_benchmark.sh runs all and keeps the rows as CSV.
// `vertices_missing_or_extra`: the difference between the vertices of a library's hull and of
// hulld's exact, audited one.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>

#include "core/hull/audit.h"
#include "core/hull/growth/hull_builder.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/hulls/clouds.h"
#include "tests/bench/hulls/peer_hulls.h"

namespace hulld::bench {
namespace {

// Passes over a stream; the index-wise minima are its latencies.
constexpr int kPasses = 5;

// One cloud, created when the first benchmark needs it.
class Workload {
 public:
  explicit Workload(std::string name) : name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  const std::vector<Vector>& points() {
    if (points_.empty()) points_ = MakeCloud(name_);
    return points_;
  }
  // Returns the number of vertices of the exact hull; 0 if the audit failed.
  size_t vertices() {
    if (vertices_ == 0) {
      HullBuilder builder;
      if (!builder.Add(points()).ok()) return 0;
      const Hull hull = builder.Snapshot();
      vertices_ = AuditHull(hull).ok() ? hull.vertices().size() : 0;
    }
    return vertices_;
  }

 private:
  std::string name_;
  std::vector<Vector> points_;
  size_t vertices_ = 0;
};

using Function = void (*)(benchmark::State&, Workload&);

// Returns false, with the reason in the state, if there is nothing to measure.
bool IsReady(benchmark::State& state, Workload& workload) {
  if (workload.points().empty()) {
    state.SkipWithError("skipped: no data");
  } else if (workload.vertices() == 0) {
    state.SkipWithError("the audit failed");
  } else {
    return true;
  }
  return false;
}

void Report(benchmark::State& state, Workload& workload, size_t vertices) {
  const auto difference = static_cast<double>(vertices) - static_cast<double>(workload.vertices());
  state.counters["points"] = static_cast<double>(workload.points().size());
  state.counters["vertices"] = static_cast<double>(vertices);
  state.counters["vertices_missing_or_extra"] = difference < 0 ? -difference : difference;
}

void BuildByHulld(benchmark::State& state, Workload& workload) {
  if (!IsReady(state, workload)) return;
  size_t vertices = 0;
  for (auto _ : state) {
    HullBuilder builder;
    benchmark::DoNotOptimize(builder.Add(workload.points()));
    vertices = builder.vertex_count();
  }
  Report(state, workload, vertices);
}

void MakeSnapshot(benchmark::State& state, Workload& workload) {
  if (!IsReady(state, workload)) return;
  HullBuilder builder;
  if (!builder.Add(workload.points()).ok()) return state.SkipWithError("the points were refused");
  for (auto _ : state) benchmark::DoNotOptimize(builder.Snapshot());
  Report(state, workload, builder.vertex_count());
}

void BuildByQhull(benchmark::State& state, Workload& workload) {
  if (!IsReady(state, workload)) return;
  std::vector<double> coordinates;
  for (const Vector& p : workload.points()) {
    coordinates.insert(coordinates.end(), p.begin(), p.end());
  }
  size_t vertices = 0;
  for (auto _ : state) vertices = QhullVertices(coordinates);
  Report(state, workload, vertices);
}

void BuildByCgal(benchmark::State& state, Workload& workload) {
  if (!IsReady(state, workload)) return;
  const CgalPoints points(workload.points());
  size_t vertices = 0;
  for (auto _ : state) vertices = points.HullVertices();
  Report(state, workload, vertices);
}

// A hull that grows point by point.
class HulldStream {
 public:
  void Insert(const Vector& point) {
    benchmark::DoNotOptimize(builder_.Add(std::span(&point, 1)).ok());
  }
  size_t HullVertices() const { return builder_.vertex_count(); }

 private:
  HullBuilder builder_;
};

template <typename Stream>
void InsertOneByOne(benchmark::State& state, Workload& workload) {
  if (!IsReady(state, workload)) return;
  size_t vertices = 0;
  for (auto _ : state) {
    Stream stream;
    for (const Vector& point : workload.points()) stream.Insert(point);
    vertices = stream.HullVertices();
  }
  Report(state, workload, vertices);
}

// Returns the minimum time of each point over kPasses passes, ascending. Includes one reading of
// the clock, about 20 to 30 ns.
template <typename Stream>
std::vector<double> SortedLatencies(const std::vector<Vector>& points) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> least(points.size(), 1e300);
  for (int pass = 0; pass < kPasses; ++pass) {
    Stream stream;
    Clock::time_point before = Clock::now();
    for (size_t i = 0; i < points.size(); ++i) {
      stream.Insert(points[i]);
      const Clock::time_point after = Clock::now();
      least[i] =
          std::min(least[i], std::chrono::duration<double, std::micro>(after - before).count());
      before = after;
    }
  }
  std::sort(least.begin(), least.end());
  return least;
}

template <typename Stream>
void MeasureStream(benchmark::State& state, Workload& workload) {
  InsertOneByOne<Stream>(state, workload);
  if (state.error_occurred()) return;
  const std::vector<double> latencies = SortedLatencies<Stream>(workload.points());
  const auto quantile = [&](double q) {
    return latencies[static_cast<size_t>(q * static_cast<double>(latencies.size() - 1))];
  };
  state.counters["p50_us"] = quantile(0.5);
  state.counters["p99_us"] = quantile(0.99);
  state.counters["p999_us"] = quantile(0.999);
  state.counters["max_us"] = latencies.back();
}

// Medians of three, each long enough to measure.
benchmark::internal::Benchmark* Add(const std::string& suite, const std::string& library,
                                    Function function, const std::shared_ptr<Workload>& workload) {
  const std::string name = suite + "/" + workload->name() + "/" + library;
  return benchmark::RegisterBenchmark(name.c_str(),
                                      [=](benchmark::State& state) { function(state, *workload); })
      ->Unit(benchmark::kMillisecond)
      ->MinTime(0.1)
      ->Repetitions(3);
}

void RegisterBuilds() {
  for (const char* name :
       {"ball:1000", "ball:10000", "ball:100000", "ball:1000000", "cube:1000000", "sphere:10000",
        "sphere:100000", "sphere:1000000", "mesh:stanford-bunny.obj", "mesh:rocker-arm.obj",
        "mesh:spot.obj", "scan:134345", "lattice:50"}) {
    const auto workload = std::make_shared<Workload>(name);
    Add("build", "hulld", BuildByHulld, workload);
    // Benchmarks that take many seconds run only a single time.
    const int repetitions = workload->name() == "sphere:1000000" ? 1 : 3;
    Add("build", "qhull", BuildByQhull, workload)->Repetitions(repetitions);
    Add("build", "cgal", BuildByCgal, workload)->Repetitions(repetitions);
  }
}

void RegisterSnapshots() {
  for (const char* name : {"sphere:64", "sphere:1000", "sphere:10000", "sphere:100000",
                           "sphere:1000000", "mesh:stanford-bunny.obj", "lattice:50"}) {
    const auto workload = std::make_shared<Workload>(name);
    Add("snapshot", "hulld builds", BuildByHulld, workload);
    Add("snapshot", "hulld makes a snapshot", MakeSnapshot, workload);
  }
}

void RegisterStreams() {
  for (const char* name : {"ball:100000", "sphere:100000"}) {
    const auto workload = std::make_shared<Workload>(name);
    Add("stream", "hulld one at a time", MeasureStream<HulldStream>, workload);
    Add("stream", "cgal delaunay one at a time", MeasureStream<CgalStream>, workload)
        ->Repetitions(1);
  }
  for (const char* name : {"ball:1000000", "sphere:1000000"}) {
    Add("stream", "hulld one at a time", MeasureStream<HulldStream>,
        std::make_shared<Workload>(name));
  }
}

void RegisterCosts() {
  for (const char* shape : {"ball", "sphere"}) {
    for (const int n : {100, 300, 1000, 3000, 10000, 30000, 100000, 300000, 1000000}) {
      const auto workload =
          std::make_shared<Workload>(std::string(shape) + ":" + std::to_string(n));
      Add("cost", "hulld", BuildByHulld, workload);
      Add("cost", "hulld one at a time", InsertOneByOne<HulldStream>, workload);
      Add("cost", "qhull", BuildByQhull, workload)->Repetitions(n > 100000 ? 1 : 3);
      Add("cost", "cgal", BuildByCgal, workload)->Repetitions(n > 100000 ? 1 : 3);
      if (n > 100000) continue;
      Add("cost", "cgal delaunay one at a time", InsertOneByOne<CgalStream>, workload)
          ->Repetitions(n > 10000 ? 1 : 3);
    }
  }
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  hulld::bench::RegisterBuilds();
  hulld::bench::RegisterSnapshots();
  hulld::bench::RegisterStreams();
  hulld::bench::RegisterCosts();
  return hulld::bench::RunBenchmarks(argc, argv);
}
