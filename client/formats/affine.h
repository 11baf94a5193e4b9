#ifndef HULLD_CLIENT_FORMATS_AFFINE_H_
#define HULLD_CLIENT_FORMATS_AFFINE_H_

#include <array>
#include <cstddef>

namespace hulld {

// The transform of a node, as a row-major 3 x 4 matrix: three columns of rotation, scale, and
// shear, then the translation.
struct Affine {
  std::array<std::array<double, 4>, 3> m = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
};

inline Affine operator*(const Affine& a, const Affine& b) {
  Affine product;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? a.m[row][3] : 0;
      for (size_t k = 0; k < 3; ++k) sum += a.m[row][k] * b.m[k][column];
      product.m[row][column] = sum;
    }
  }
  return product;
}

// Sums from left to right: ((m0 x + m1 y) + m2 z) + m3.
inline std::array<double, 3> operator*(const Affine& a, const std::array<double, 3>& p) {
  std::array<double, 3> q;
  for (size_t row = 0; row < 3; ++row) {
    const auto& m = a.m[row];
    q[row] = m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3];
  }
  return q;
}

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_AFFINE_H_
