#ifndef HULLD_CORE_QUERY_BODY_BOX_GAP_H_
#define HULLD_CORE_QUERY_BODY_BOX_GAP_H_

#include "core/numeric/vector.h"
#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"

namespace hulld {

// Lower bounds on the separation of boxes of two bodies, each box in its body's frame and grown by
// the body's radius.
class BoxGap {
 public:
  BoxGap(const PlacedBody& x, const PlacedBody& y);

  // Returns a **proven** lower bound on the separation of any two hulls in the boxes: the largest
  // gap along the axes of both boxes. Negative if all axes show an overlap, because no penetration
  // is deeper than the overlap along any axis. Infinite if a box is empty, minus infinity if no
  // bound is known.
  double AtLeast(const Box& of_x, const Box& of_y) const;

 private:
  // R_XY is the orientation of frame Y in frame X, p_XY the position of Y's origin.
  Eigen::Matrix3d R_XY_;
  Eigen::Matrix3d abs_R_XY_;
  Vector p_XY_;
  double error_ = 0;
  bool usable_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_BOX_GAP_H_
