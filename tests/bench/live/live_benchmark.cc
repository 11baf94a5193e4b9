// Cost of a step of a growing hull, for hulld and for Bullet: some points are added, then some
// queries run.
//
//   live_benchmark [MAX_VERTICES [SECONDS]]
//
// with_box_us: the median of a step that also updates the bounding box; hulld always does, Bullet
// by addPoint's default. One row of CSV per workload, number of vertices, and library. Both process
// the same points and queries alternately, step by step; while Bullet has taken more than half of
// the time, steps only add the points to its hull. Like the server, hulld prepares in the
// background once queries have scanned as much as preparation costs. Bullet appends a point to its
// list and builds nothing; the faster of its two GJKs counts. The probe is a hull of 64 vertices
// near contact: if the growing hull were a sphere, they would be separated or overlap by at most a
// tenth of its radius.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"
#include "core/query/placed/live_hull.h"
#include "tests/bench/bench_random.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/live/growing_peer.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Workload {
  const char* name;
  int points;
  int queries;
  bool inside = false;
  // Each step begins with the points alone, like a hull read from disk.
  bool cold = false;
};
constexpr Workload kWorkloads[] = {
    {"1 point, 1 query", 1, 1},
    {"30 points, 1 query", 30, 1},
    {"1000 points, 1 query", 1000, 1},
    {"1 point, 30 queries", 1, 30},
    {"1 point, 1000 queries", 1, 1000},
    {"1 inside point, 1 query", 1, 1, true},
    {"first query, cold", 0, 1, false, true},
};
constexpr int kProbeVertices = 64;
constexpr double kProbeRadius = 1;

double Microseconds(Clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

// Returns the quantile of values, which are reordered.
double Quantile(std::vector<double>& values, double quantile) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<ptrdiff_t>(quantile * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Prepares one live hull in the background.
class Preparer {
 public:
  Preparer() : thread_([this] { Work(); }) {}
  ~Preparer() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    ready_.notify_one();
    thread_.join();
  }
  void Submit(LiveHull& live, const LiveHull::Mark& mark) {
    if (busy_.exchange(true)) return;
    {
      const std::lock_guard lock(mutex_);
      task_ = [&live, mark] { live.Prepare(mark); };
    }
    ready_.notify_one();
  }
  void Wait() {
    while (busy_) std::this_thread::yield();
  }

 private:
  void Work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      ready_.wait(lock, [this] { return ending_ || task_; });
      if (ending_) return;
      const std::function<void()> task = std::exchange(task_, nullptr);
      lock.unlock();
      task();
      busy_ = false;
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable ready_;
  std::function<void()> task_;
  bool ending_ = false;
  std::atomic<bool> busy_ = false;
  std::thread thread_;
};

struct Times {
  std::vector<double> step;
  std::vector<double> add;
  std::vector<double> ask;
  std::vector<double> with_box;
};

class Run {
 public:
  Run(const Workload& workload, int vertices, double seconds)
      : workload_(workload), vertices_(vertices), seconds_(seconds), random_(vertices) {
    HullBuilder builder;
    std::vector<Vector> points;
    for (int i = 0; i < kProbeVertices; ++i) points.push_back(OnSphere(kProbeRadius));
    HULLD_CHECK(builder.Add(points).ok());
    probe_ = builder.Snapshot();
    query_probe_.emplace(probe_);
    peer_probe_ = MakeGrowingPeer(probe_.vertices());
  }

  void Print() {
    std::vector<Vector> points;
    for (int i = 0; i < vertices_; ++i) points.push_back(OnSphere(1));
    HullBuilder start;
    HULLD_CHECK(start.Add(points).ok());
    const auto begin = Clock::now();
    // The hull keeps its approximate size: it restarts after it has grown by a half.
    const int max_steps = std::max(1, vertices_ / 2 / std::max(1, workload_.points));
    do {
      if (workload_.cold) {
        QueryCold(start.Vertices());
      } else {
        Grow(start, points, std::min(max_steps, 20000));
      }
    } while (Microseconds(Clock::now() - begin) < seconds_ * 1e6);
    Row("hulld", hulld_, moved_ / static_cast<double>(hulld_.step.size()));
    if (!peer_.step.empty()) Row("Bullet", peer_, 0);
    std::fflush(stdout);
  }

 private:
  Vector OnSphere(double radius) { return radius * random_.UnitVector(); }

  void Grow(const HullBuilder& start, const std::vector<Vector>& points, int steps) {
    HullBuilder builder = start;
    LiveHull live(builder.Vertices(), builder.dimension());
    LiveHull::Mark mark = live.Now();
    live.Prepare(mark);
    const uint64_t moved = live.points_moved();
    const std::unique_ptr<GrowingPeer> peer = MakeGrowingPeer(points);
    const auto begin = Clock::now();
    double peer_time = 0;
    std::vector<Vector> added(workload_.points);
    std::vector<Pose> poses(workload_.queries);
    for (int step = 0; step < steps; ++step) {
      const double elapsed = Microseconds(Clock::now() - begin);
      if (elapsed > 1e6 * seconds_) break;
      for (Vector& p : added) p = OnSphere(workload_.inside ? 0.5 : 1 + 1e-6 * (step + 1));
      for (Pose& pose : poses) {
        pose.q = random_.Rotation();
        pose.t = OnSphere(1 + kProbeRadius + random_.Between(-0.1, 0.1));
      }
      const int colliding = StepHulld(builder, live, mark, added, poses);
      // The peer gets at most half of the time.
      if (peer == nullptr) continue;
      if (peer_time < elapsed / 2 || step < 3) {
        const auto before = Clock::now();
        disagreements_ += std::abs(StepPeer(*peer, added, poses) - colliding);
        peer_time += Microseconds(Clock::now() - before);
      } else {
        for (const Vector& p : added) peer->Add(p);
      }
    }
    preparer_.Wait();
    moved_ += static_cast<double>(live.points_moved() - moved);
  }

  void QueryCold(std::vector<Vector> points) {
    Pose pose;
    pose.q = random_.Rotation();
    pose.t = OnSphere(1 + kProbeRadius + random_.Between(-0.1, 0.1));
    // Adding the points is part of the peer's step.
    const std::unique_ptr<GrowingPeer> peer = MakeGrowingPeer({});
    const int peer_colliding = peer == nullptr ? 0 : StepPeer(*peer, points, {pose});
    const auto start = Clock::now();
    const LiveHull live(std::move(points), 3);
    const auto taken = Clock::now();
    const std::shared_ptr<const QueryHull> version = live.VersionAt(live.Now());
    const absl::StatusOr<Answer> answer =
        CheckCollision(PlacedHull(*version, Pose()), PlacedHull(*query_probe_, pose));
    const auto end = Clock::now();
    const int colliding = answer->relation != Relation::kSeparated;
    if (peer != nullptr) disagreements_ += std::abs(peer_colliding - colliding);
    hulld_.step.push_back(Microseconds(end - start));
    hulld_.add.push_back(Microseconds(taken - start));
    hulld_.ask.push_back(Microseconds(end - taken));
    hulld_.with_box.push_back(Microseconds(end - start));
  }

  int StepHulld(HullBuilder& builder, LiveHull& live, LiveHull::Mark& mark,
                const std::vector<Vector>& added, const std::vector<Pose>& poses) {
    int colliding = 0;
    const auto start = Clock::now();
    const absl::StatusOr<PointCounts> counts = builder.Add(added);
    if (counts->outside > 0) mark = live.Append(builder.NewVertices(), builder.dimension());
    const auto grown = Clock::now();
    const std::shared_ptr<const QueryHull> version = live.VersionAt(mark);
    const PlacedHull placed(*version, Pose());
    for (const Pose& pose : poses) {
      const absl::StatusOr<Answer> answer = CheckCollision(placed, PlacedHull(*query_probe_, pose));
      colliding += answer->relation != Relation::kSeparated;
    }
    if (live.WantsPreparing(mark)) preparer_.Submit(live, mark);
    const auto end = Clock::now();
    hulld_.step.push_back(Microseconds(end - start));
    hulld_.add.push_back(Microseconds(grown - start));
    hulld_.ask.push_back(Microseconds(end - grown));
    hulld_.with_box.push_back(Microseconds(end - start));
    return colliding;
  }

  int StepPeer(GrowingPeer& peer, const std::vector<Vector>& added,
               const std::vector<Pose>& poses) {
    int colliding = 0;
    const auto start = Clock::now();
    for (const Vector& p : added) peer.Add(p);
    const auto grown = Clock::now();
    double solver = 0;
    double detector = 0;
    for (const Pose& pose : poses) {
      const auto one = Clock::now();
      colliding += peer.CollidesBySolver(*peer_probe_, pose);
      const auto two = Clock::now();
      peer.CollidesByDetector(*peer_probe_, pose);
      solver += Microseconds(two - one);
      detector += Microseconds(Clock::now() - two);
    }
    const double add = Microseconds(grown - start);
    const double ask = std::min(solver, detector);
    peer_.step.push_back(add + ask);
    peer_.add.push_back(add);
    peer_.ask.push_back(ask);
    const auto before_box = Clock::now();
    peer.UpdateBox();
    peer_.with_box.push_back(add + ask + Microseconds(Clock::now() - before_box));
    return colliding;
  }

  void Row(const char* library, Times& times, double moved) {
    const size_t steps = times.step.size();
    std::printf("\"%s\",%s,%d,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.2f,%zu,%d,\"%s\",\"%s\"\n",
                workload_.name, library, vertices_, Quantile(times.step, 0.5),
                Quantile(times.step, 0.99), Quantile(times.step, 1), Quantile(times.add, 0.5),
                Quantile(times.ask, 0.5), Quantile(times.with_box, 0.5), moved, steps,
                disagreements_, CompilerName().c_str(), CpuName().c_str());
  }

  const Workload& workload_;
  const int vertices_;
  const double seconds_;
  Random random_;
  Hull probe_;
  std::optional<QueryHull> query_probe_;
  std::unique_ptr<GrowingPeer> peer_probe_;
  Times hulld_;
  Times peer_;
  double moved_ = 0;
  int disagreements_ = 0;
  Preparer preparer_;
};

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) {
  const int most = argc > 1 ? std::atoi(argv[1]) : 1000000;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 3;
  std::printf(
      "workload,library,vertices,step_us,p99_us,max_us,add_us,ask_us,with_box_us,moved,steps,"
      "disagree,"
      "compiler,cpu\n");
  for (const hulld::bench::Workload& workload : hulld::bench::kWorkloads) {
    for (const int vertices : {64, 1000, 10000, 100000, 1000000}) {
      if (vertices > most) break;
      hulld::bench::Run(workload, vertices, seconds).Print();
    }
  }
}
