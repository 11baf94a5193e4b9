#ifndef HULLD_CORE_QUERY_TERMS_MOTION_H_
#define HULLD_CORE_QUERY_TERMS_MOTION_H_

#include <absl/status/status.h>

#include <array>

#include "core/numeric/integer.h"
#include "core/query/terms/pose.h"

namespace hulld {

// A motion X_WA(t) of frame A in the world over the times t in [0, 1]: the rotation q(t) = (1 - t)
// q0 + t q1 and the translation x(t) = (1 - t) x0 + t x1 over the reals, for the quaternions and
// translations of `start` and `end` as given. q1 and -q1 are the same rotation but the ends of
// different motions, and the lengths of q0 and q1 determine the timing.
struct Motion {
  Pose start;
  Pose end;
};

// Returns true if q1 = s q0 for a positive s: the rotation is the same at all times. Requires: both
// poses valid. Exact. Cost: about 10 ns if all components are equal.
bool IsTranslation(const Motion& motion);

// Returns OK, or INVALID_ARGUMENT: a pose fails ValidatePose, with "end." before the name of a
// field of the end; or q(t) vanishes at some t, which happens if and only if q1 = -s q0 for a
// positive s. Exact.
absl::Status ValidateMotion(const Motion& motion);

// Exact values of a motion at a time in [0, 1], in integers.
//
// Returns a positive multiple of q(time).
std::array<Integer, 4> QuaternionAt(const Motion& motion, double time);
// Returns the exponent of a power of two that divides x(time).
int TranslationExponentAt(const Motion& motion, double time);
// Returns x(time) over 2^exponent. Requires: exponent <= TranslationExponentAt(motion, time).
IntegerVector TranslationAt(const Motion& motion, double time, int exponent);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_MOTION_H_
