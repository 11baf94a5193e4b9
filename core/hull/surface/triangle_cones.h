#ifndef HULLD_CORE_HULL_SURFACE_TRIANGLE_CONES_H_
#define HULLD_CORE_HULL_SURFACE_TRIANGLE_CONES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld {

// The cones in which the interior point of a surface sees its triangles, for locating many points
// on a surface that does not change meanwhile. A cone is computed at its first use.
class TriangleCones {
 public:
  // A triangle's plane and neighbors, as in SurfaceTriangle, and normals of the planes through the
  // interior point and edge i, inwards.
  struct Cone {
    Vector normal;
    double offset;
    float slope;
    std::array<uint32_t, 3> neighbors;
    std::array<Vector, 3> sides;

    // y: a point relative to the interior point. Returns the triple products of y and two corners,
    // positive if y is on the inner side of edge i.
    std::array<double, 3> TurnsTo(const Vector& y) const {
      return {Dot(y, sides[0]), Dot(y, sides[1]), Dot(y, sides[2])};
    }
  };

  // Triangles have IDs below `id_bound`.
  explicit TriangleCones(size_t id_bound) : places_(id_bound, 0) { cones_.reserve(64); }
  // Call if the interior point changed.
  void Clear() {
    places_.assign(places_.size(), 0);
    cones_.clear();
    near_ = kNone;
  }

  // Returns the cone of a triangle, computed by make(id) if necessary; valid until the next call.
  template <typename Make>
  const Cone& Get(uint32_t id, Make&& make) {
    uint32_t& place = places_[id];
    if (place == 0) {
      cones_.push_back(make(id));
      place = static_cast<uint32_t>(cones_.size());
    }
    return cones_[place - 1];
  }
  // A triangle near which the next point is expected, if any, and its cone. SetNear requires kNone,
  // or a triangle whose cone was computed.
  static constexpr uint32_t kNone = UINT32_MAX;
  void SetNear(uint32_t id) { near_ = id; }
  uint32_t near_triangle() const { return near_; }
  const Cone* near() const { return near_ == kNone ? nullptr : &cones_[places_[near_] - 1]; }

 private:
  // By triangle: the position in `cones_`, from 1; 0 if there is none.
  std::vector<uint32_t> places_;
  std::vector<Cone> cones_;
  uint32_t near_ = kNone;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_TRIANGLE_CONES_H_
