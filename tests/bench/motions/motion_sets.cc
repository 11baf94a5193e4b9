#include "tests/bench/motions/motion_sets.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "core/query/motion/first_contact.h"
#include "tests/bench/bench_random.h"

namespace hulld::bench {
namespace {

// To about 1e-7 of the sizes: below the passages, and above the resolution of answers.
constexpr int kBisections = 23;

// Returns the motion with its path shifted.
Motion Shifted(Motion motion, const Vector& shift) {
  motion.start.t += shift;
  motion.end.t += shift;
  return motion;
}

// Returns the least shift along `direction` at which B passes A without a contact. Unshifted, B
// passes through A's center; `direction` is across the path.
double ShiftToMiss(const QueryHull& a, const Pose& X_WA, const QueryHull& b, const Motion& X_WB,
                   const Vector& direction, double reach) {
  double meets = 0;
  double misses = 1.01 * reach;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (meets + misses);
    const FirstContact contact =
        *FindFirstContact({a, {X_WA, X_WA}}, {b, Shifted(X_WB, middle * direction)});
    (contact.relation == Relation::kSeparated ? misses : meets) = middle;
  }
  return misses;
}

// The shift of a passage.
double ShiftFor(Passage passage, double to_miss, double reach, Random& random) {
  switch (passage) {
    case Passage::kHit:
      return to_miss * random.Between(0.5, 0.9);
    case Passage::kGraze:
      return to_miss - 1e-6 * reach;
    case Passage::kNearMiss:
      return to_miss + 1e-6 * reach;
    case Passage::kMiss:
      break;
  }
  return to_miss + reach * random.Between(0.01, 0.05);
}

}  // namespace

std::array<double, 4> Turned(const std::array<double, 4>& q, const Vector& axis) {
  const Eigen::Quaterniond turned =
      Eigen::AngleAxisd(M_PI / 6, axis) * Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  return {turned.w(), turned.x(), turned.y(), turned.z()};
}

const char* Name(Passage passage) {
  switch (passage) {
    case Passage::kHit:
      return "hit";
    case Passage::kGraze:
      return "graze";
    case Passage::kNearMiss:
      return "near miss";
    case Passage::kMiss:
      break;
  }
  return "miss";
}

MotionSet MakeMotionSet(std::shared_ptr<const QuerySet> hulls, bool turns, Passage passage,
                        size_t count) {
  MotionSet set;
  set.hulls = std::move(hulls);
  Random random(20261126 + 2 * static_cast<uint64_t>(passage) + (turns ? 1 : 0));
  for (size_t i = 0; i < count; ++i) {
    const size_t hull_a = random.Below(set.hulls->hulls.size());
    const size_t hull_b = random.Below(set.hulls->hulls.size());
    const QueryHull& a = set.hulls->query_hulls[hull_a];
    const QueryHull& b = set.hulls->query_hulls[hull_b];
    const double reach = a.radius() + b.radius();
    const Pose X_WA = {random.Rotation(), random.UnitVector() * random.Between(0, 2)};
    const Vector path = 4 * reach * random.UnitVector();
    const Vector across = path.cross(random.UnitVector()).normalized();
    Motion X_WB;
    X_WB.start.q = random.Rotation();
    X_WB.end.q = turns ? Turned(X_WB.start.q, random.UnitVector()) : X_WB.start.q;
    const double nearest_time = random.Between(0.4, 0.6);
    X_WB.start.t = PlacedHull::Make(a, X_WA)->rotated_center() + X_WA.t - nearest_time * path;
    X_WB.end.t = X_WB.start.t + path;
    const double to_miss = ShiftToMiss(a, X_WA, b, X_WB, across, reach);
    const double shift = ShiftFor(passage, to_miss, reach, random);
    set.queries.push_back({hull_a, hull_b, X_WA, Shifted(X_WB, shift * across)});
  }
  return set;
}

}  // namespace hulld::bench
