#ifndef HULLD_CORE_QUERY_BODY_BOX_GAP_H_
#define HULLD_CORE_QUERY_BODY_BOX_GAP_H_

#include "core/numeric/vector.h"
#include "core/query/body/placed_body.h"
#include "core/query/box_tree.h"

namespace hulld {

// How far apart boxes of two bodies are at least, each box in the frame of its body.
class BoxGap {
 public:
  BoxGap(const PlacedBody& x, const PlacedBody& y);

  // A lower bound of the separation of any two hulls in the boxes, proven: the largest gap along
  // the axes of both, negative where all show an overlap, as no penetration is deeper than the
  // overlap along any axis. Infinite where a box is empty, minus infinity where nothing is known.
  double AtLeast(const Box& of_x, const Box& of_y) const;

 private:
  // R_XY: the frame of Y in that of X, and p_XY where its origin is.
  Eigen::Matrix3d R_XY_;
  Eigen::Matrix3d abs_R_XY_;
  Vector p_XY_;
  double error_ = 0;
  bool usable_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_BODY_BOX_GAP_H_
