#ifndef HULLD_CORE_NUMERIC_VECTOR_H_
#define HULLD_CORE_NUMERIC_VECTOR_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/numeric/ieee_arithmetic.h"

namespace hulld {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A point or a direction: three doubles. A point is in the caller's length unit.
using Vector = Eigen::Vector3d;

// The operations of IntegerVector for doubles, rounded.
inline double Dot(const Vector& a, const Vector& b) { return a.dot(b); }
inline Vector Cross(const Vector& a, const Vector& b) { return a.cross(b); }
inline bool IsZero(const Vector& a) { return a.x() == 0 && a.y() == 0 && a.z() == 0; }
// Returns the largest absolute component. As exact as Eigen's, and faster for three components.
inline double LargestComponent(const Vector& a) {
  return std::max(std::abs(a.x()), std::max(std::abs(a.y()), std::abs(a.z())));
}
inline int Sign(double a) { return (a > 0) - (a < 0); }

}  // namespace hulld

#endif  // HULLD_CORE_NUMERIC_VECTOR_H_
