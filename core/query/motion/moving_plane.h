#ifndef HULLD_CORE_QUERY_MOTION_MOVING_PLANE_H_
#define HULLD_CORE_QUERY_MOTION_MOVING_PLANE_H_

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/numeric/vector.h"
#include "core/query/motion/first_contact.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/terms/pose.h"

namespace hulld {

// Turning planes that separate two hulls in motion over intervals of time, in floating point with
// proven error bounds.
//
// Let q(t) be the rotation of a hull and x(t) its translation. For a plane n(t).p = c(t), with n
// and c linear in t, and a vertex v, |q(t)|^2 (n.p(t) - c) = (R(q(t))^T n).v + |q(t)|^2 (n.x(t) -
// c) is a polynomial in t of degree 4. The Bernstein coefficients of R(q(t))^T n over an interval
// are five directions in the hull's frame, and the maximum of a coefficient over all vertices is
// the hull's support value along one of these directions. So five support values of each hull prove
// a plane for all vertices and all times in the interval (Farouki and Rajan 1987). The offset may
// be chosen last: each coefficient bounds it. The pose of a piece in its body does not depend on
// time: it turns the five directions into the piece's frame, and adds a constant to each support
// value. For a hull at rest, the polynomial is linear, and the support values at both ends suffice.
//
// Caches the poses at the most recently used times, and support values at the ends of intervals.
class MovingPlane {
 public:
  // Both hulls must outlive the result. Requires: valid motions (ValidateMotion), and neither hull
  // is empty.
  MovingPlane(const MovingHull& a, const MovingHull& b);

  // The size of the pair: the sum of the largest absolute coordinates of the hulls and of their
  // translations, and of the radii.
  double size() const { return size_; }

  // Returns false if planes may be unprovable from this time on, however far apart the hulls are:
  // their sizes are out of range, or a rotation nearly vanishes (below twice
  // kInterpolationMinRemainder).
  bool IsUsableAt(double time);

  // Return the pose of each moving frame at a time in [0, 1], rounded as in planes, with a
  // quaternion of any length. Requires: IsUsableAt(time).
  Pose PoseOfA(double time) { return PoseAt(a_, time); }
  Pose PoseOfB(double time) { return PoseAt(b_, time); }
  // Returns the gap along a direction n (as in Try) at a time in [0, 1], up to rounding. Requires:
  // as above.
  double GapAt(const Vector& n, double time);

  struct Result {
    // True if A and B, with their radii, lie on opposite sides of the plane with these offsets,
    // each farther than `margin` from it, at all times in the interval.
    bool proven = false;
    double offset = 0;
    double end_offset = 0;
    // Width of the range in which both offsets may move together, minus error bounds: a lower bound
    // of the minimum separation, up to rounding. -infinity if a hull turns too far for any bound.
    // If not proven, it may exceed the separation, but not the gap at either end.
    double gap = -std::numeric_limits<double>::infinity();
    // The gap along the direction at the end, up to rounding.
    double end_gap = -std::numeric_limits<double>::infinity();
  };
  // Tries the direction that turns from n0 to n1 (world frame, from A toward B, of unit length up
  // to rounding) from time `start` to `end`. The margin may be negative. Requires: 0 <= start <=
  // end <= 1, and the same direction if the times are equal.
  Result Try(const Vector& n0, const Vector& n1, double start, double end, double margin = 0);

 private:
  // A pose at a time, rounded. The largest component of q is below 1.
  struct Frame {
    double time = -1;
    std::array<double, 4> q;
    PlainVector x;
    // |q|^2, and the columns of R(q).
    double squared_norm;
    std::array<PlainVector, 3> columns;
    // False if q is shorter than kInterpolationMinRemainder.
    bool usable;

    // Computes the rotation from q.
    void SetRotation();
    // Returns R(q)^T n.
    PlainVector TurnedBack(const PlainVector& n) const;
  };
  // The largest value of R(q(time))^T n over a hull, in the frame of its motion.
  struct Reach {
    double time = -1;
    PlainVector n;
    double value;
  };
  // The pose of a piece in its body.
  struct PieceFrame {
    Eigen::Matrix3d R_BH;
    Vector p_BH;
  };
  struct Side {
    const QueryHull* hull;
    // Empty if it is the identity.
    std::optional<PieceFrame> piece;
    // Quaternions at both ends of the motion, scaled by a common power of two.
    std::array<double, 4> q0;
    std::array<double, 4> q1;
    Vector x0;
    Vector x1;
    // Sum of the largest absolute coordinates of the hull and of each of its translations.
    double size;
    // At least the sum of the radii times the length of a direction.
    double radius;
    // True if the motion ends where it starts.
    bool at_rest;
    // Most recently used poses.
    std::array<Frame, 4> frames = {};
    uint32_t oldest = 0;
    // Most recently computed values: a step begins with the direction at the end of the last one.
    std::array<Reach, 8> reaches = {};
    uint32_t oldest_reach = 0;
  };
  class Bounds;

  static Side SideOf(const MovingHull& moving);
  // Returns the pose at a time, valid until the next call; a frame that is `kept` stays valid, too.
  static const Frame& FrameAt(Side& side, double time, const Frame* kept = nullptr);
  static Pose PoseAt(Side& side, double time);
  // Returns the largest value of each direction over a hull, in the frame of its motion.
  template <size_t kCount>
  static std::array<double, kCount> HullReach(const Side& side,
                                              std::array<PlainVector, kCount> turned);
  // Returns the largest value of R(q)^T n over the hull, for q of the frame.
  static double TurnedReach(Side& side, const Frame& frame, const PlainVector& n);
  // Returns the largest value of n.p over the hull at a frame, up to rounding.
  static double ReachAt(Side& side, const PlainVector& n, double time);

  Side a_;
  Side b_;
  double size_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_MOVING_PLANE_H_
