#ifndef HULLD_CORE_QUERY_PLACED_PLAIN_VECTOR_H_
#define HULLD_CORE_QUERY_PLACED_PLAIN_VECTOR_H_

#include <algorithm>
#include <cmath>

#include "core/numeric/vector.h"

namespace hulld {

// A Vector for latency-bound code, that is, chains of dependent operations: three doubles that stay
// in registers. Eigen writes a vector of three as a pair and a single double, and may read it in a
// different grouping. A read that spans two writes probably waits until both have left the
// processor's store buffer. Observed: a search takes a quarter less time if it uses this class and
// its sources are compiled with hulld_keep_scalar.
struct PlainVector {
  double x = 0;
  double y = 0;
  double z = 0;

  PlainVector() = default;
  PlainVector(double x_in, double y_in, double z_in) : x(x_in), y(y_in), z(z_in) {}
  PlainVector(const Vector& v) : x(v.x()), y(v.y()), z(v.z()) {}  // NOLINT: the same thing
  operator Vector() const { return {x, y, z}; }                   // NOLINT

  friend PlainVector operator+(const PlainVector& p, const PlainVector& q) {
    return {p.x + q.x, p.y + q.y, p.z + q.z};
  }
  friend PlainVector operator-(const PlainVector& p, const PlainVector& q) {
    return {p.x - q.x, p.y - q.y, p.z - q.z};
  }
  friend PlainVector operator-(const PlainVector& p) { return {-p.x, -p.y, -p.z}; }
  friend PlainVector operator*(double s, const PlainVector& p) {
    return {s * p.x, s * p.y, s * p.z};
  }
};

inline double Dot(const PlainVector& p, const PlainVector& q) {
  return p.x * q.x + p.y * q.y + p.z * q.z;
}
inline PlainVector Cross(const PlainVector& p, const PlainVector& q) {
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}
inline double SquaredNorm(const PlainVector& p) { return Dot(p, p); }
inline double Norm(const PlainVector& p) { return std::sqrt(SquaredNorm(p)); }
inline double LargestComponent(const PlainVector& p) {
  return std::max(std::max(std::abs(p.x), std::abs(p.y)), std::abs(p.z));
}
inline bool IsZero(const PlainVector& p) { return p.x == 0 && p.y == 0 && p.z == 0; }

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_PLAIN_VECTOR_H_
