#ifndef HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_
#define HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld {

// A growing subset of the extreme points of a set, the next one always the point farthest from the
// hull of those chosen, as far as rounding lets tell.
//
// Nothing here need be exact: the triangles only guide the choice, and what is proven,
// DistanceBound, holds for any triangle of chosen points. Idea: Barber, Dobkin and Huhdanpaa 1996
// (Quickhull) for the order and for keeping each point with one triangle.
class VertexSubset {
 public:
  // `points` must outlive this. Starts with up to four points that span the set as well as any.
  // Requires a point.
  explicit VertexSubset(std::span<const Vector> points);

  // Indices, in the order chosen.
  const std::vector<uint32_t>& chosen() const { return chosen_; }
  bool is_complete() const { return chosen_.size() == points_.size(); }

  // Chooses the point that seems farthest. Requires !is_complete().
  void ChooseNext();

  // Proven: no point is farther than this from the hull of those chosen. Length unit of the points.
  // Cost: O(triangles).
  double DistanceBound() const;

 private:
  struct Triangle {
    std::array<uint32_t, 3> corners;
    // Of the scaled points; unit length.
    Vector normal;
    double offset;
    // Points not chosen that are nearest to this triangle, as far as was looked.
    std::vector<uint32_t> near;
    // The farthest of those, and a proven bound of its distance.
    uint32_t farthest = 0;
    double distance = 0;
  };

  void AddTriangle(uint32_t a, uint32_t b, uint32_t c);
  double HeightOf(const Triangle& triangle, uint32_t point) const;
  void Assign(uint32_t point, size_t first_triangle);
  void Forget(Triangle& triangle, uint32_t point);
  double DistanceTo(const Triangle& triangle, uint32_t point) const;

  std::span<const Vector> points_;
  // Moved and scaled to unit size along each axis, which changes no side of any plane.
  std::vector<Vector> scaled_;
  std::vector<uint32_t> chosen_;
  std::vector<Triangle> triangles_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SIMPLIFICATION_VERTEX_SUBSET_H_
