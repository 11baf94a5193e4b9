#ifndef HULLD_TESTS_BENCH_MOTIONS_MOTION_SETS_H_
#define HULLD_TESTS_BENCH_MOTIONS_MOTION_SETS_H_

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "core/query/terms/motion.h"
#include "core/query/terms/pose.h"
#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {

// The passage of B along A; lengths are relative to the sum of their radii.
enum class Passage {
  kHit,       // would be halfway to a tenth deep
  kGraze,     // 1e-6 deep
  kNearMiss,  // 1e-6 apart
  kMiss,      // 1 to 5 % apart
};
inline constexpr Passage kPassages[] = {Passage::kHit, Passage::kGraze, Passage::kNearMiss,
                                        Passage::kMiss};
const char* Name(Passage passage);

// Motions of a hull B past a hull A at rest. They are separated at both ends.
struct MotionSet {
  struct Query {
    size_t hull_a;
    size_t hull_b;
    Pose X_WA;
    Motion X_WB;
  };
  // Only its hulls are used.
  std::shared_ptr<const QuerySet> hulls;
  std::vector<Query> queries;

  const Hull& a(const Query& query) const { return hulls->hulls[query.hull_a]; }
  const Hull& b(const Query& query) const { return hulls->hulls[query.hull_b]; }
  const QueryHull& query_a(const Query& query) const { return hulls->query_hulls[query.hull_a]; }
  const QueryHull& query_b(const Query& query) const { return hulls->query_hulls[query.hull_b]; }
};

// Returns a rotation turned by 30 degrees about an axis.
std::array<double, 4> Turned(const std::array<double, 4>& q, const Vector& axis);

// Returns motions of the hulls in `hulls` across four times the sum of the radii: translations, or
// also rotations by 30 degrees about random axes. Fixed seeds.
MotionSet MakeMotionSet(std::shared_ptr<const QuerySet> hulls, bool turns, Passage passage,
                        size_t count);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_MOTIONS_MOTION_SETS_H_
