#ifndef HULLD_TESTS_BENCH_MOTIONS_MOTION_TRUTH_H_
#define HULLD_TESTS_BENCH_MOTIONS_MOTION_TRUTH_H_

#include <optional>
#include <vector>

#include "tests/bench/motions/motion_sets.h"

namespace hulld::bench {

// The path between two poses. They differ only for rotations, and there only in the speed along the
// same arc: by up to 5e-4 radians for 30 degrees.
enum class Path {
  kLinear,  // q(t) linear, that of hulld
  kSteady,  // constant angular velocity, that of FCL and Bullet
};

// The first contact is in [separated_until, contact_time].
struct MotionTruth {
  // Absent: too close to decide.
  std::optional<bool> meets;
  double separated_until = 1;
  double contact_time = 1;
};

// Returns the truth for each motion.
//
// kLinear: hulld's answers. The code of `hullctl verify`, which shares none with core, checks their
// certificates; a wrong one ends the program.
//
// kSteady: hulld's answers on 64 pieces of each path, which deviate from it by less than 1e-8. A
// motion with an answer that depends on this deviation is left open.
std::vector<MotionTruth> FindTruth(const MotionSet& set, Path path);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_MOTIONS_MOTION_TRUTH_H_
