#ifndef HULLD_CLIENT_POSE_VECTOR3_H_
#define HULLD_CLIENT_POSE_VECTOR3_H_

#include <array>

// Products and differences of vectors x y z in floating point.
namespace hulld {

inline double Dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline std::array<double, 3> Cross(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline std::array<double, 3> Minus(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

}  // namespace hulld

#endif  // HULLD_CLIENT_POSE_VECTOR3_H_
