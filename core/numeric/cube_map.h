#ifndef HULLD_CORE_NUMERIC_CUBE_MAP_H_
#define HULLD_CORE_NUMERIC_CUBE_MAP_H_

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/numeric/vector.h"

// Addresses of directions on the surface of the cube [-1, 1]^3. A direction divided by its largest
// component lies on one of six faces: 2 k if component k is largest and positive, 2 k + 1 if it is
// largest and negative. The coordinates on a face are the two components after k, cyclically. A map
// divides each face into side x side cells, row by row along the first coordinate.
namespace hulld {

// The two components after component k, cyclically: [k] and [k + 1].
inline constexpr uint32_t kCubeAxisAfter[4] = {1, 2, 0, 1};

inline constexpr uint32_t CubeFace(uint32_t axis, bool negative) {
  return 2 * axis + static_cast<uint32_t>(negative);
}

inline constexpr uint32_t CubeCell(uint32_t face, uint32_t side, uint32_t i, uint32_t j) {
  return (face * side + i) * side + j;
}

// Returns the direction at coordinates (s, t), from -1 to 1, of a face.
inline Vector CubeDirection(uint32_t face, double s, double t) {
  const uint32_t axis = face / 2;
  Vector n;
  n[axis] = face % 2 == 0 ? 1 : -1;
  n[kCubeAxisAfter[axis]] = s;
  n[kCubeAxisAfter[axis + 1]] = t;
  return n;
}

// The intersection of a direction with the cube: the face, and the coordinates there times
// largest(). Branch-free on data, because directions are unpredictable. Among equally large
// components, the first one wins. Zero maps to face 0, and a non-finite direction to an arbitrary
// face.
template <typename Real>
class OnCube {
 public:
  OnCube(Real x, Real y, Real z) : components_{x, y, z, x, y} {
    const Real size_x = std::abs(x);
    const Real size_y = std::abs(y);
    const Real size_z = std::abs(z);
    const Real larger = std::max(size_x, size_y);
    largest_ = std::max(larger, size_z);
    // Arithmetic on truth values, because compilers turn conditions into branches.
    const uint32_t is_y = size_y > size_x;
    const uint32_t is_z = size_z > larger;
    axis_ = (is_y & (is_z - 1)) | (2 * is_z);
  }

  // The absolute value of the largest component.
  Real largest() const { return largest_; }
  uint32_t axis() const { return axis_; }
  bool negative() const { return std::signbit(components_[axis_]); }
  uint32_t face() const { return CubeFace(axis_, negative()); }
  Real first() const { return components_[axis_ + 1]; }
  Real second() const { return components_[axis_ + 2]; }

 private:
  // The first two components are repeated, so that the two after any component need no table.
  Real components_[5];
  Real largest_;
  uint32_t axis_;
};

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_CUBE_MAP_H_
