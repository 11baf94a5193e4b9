#include "core/hull/properties.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"

namespace hulld {
namespace {

// Triangles between two polls: their integers may have thousands of bits.
constexpr uint64_t kTrianglesPerPoll = 128;

// Entries of a symmetric matrix, in the order of HullProperties::inertia.
constexpr struct {
  int row;
  int column;
} kEntries[6] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

// Sums over simplices with a corner at the origin, the first vertex of the hull, in integers. With
// d the determinant of the other three corners a, b, c of a tetrahedron, and s = a + b + c, the
// integrals of 1, x_i, and x_i x_j are d / 6, d s_i / 24, and d (a_i a_j + b_i b_j + c_i c_j + s_i
// s_j) / 120.
struct Moments {
  // The sum of d; for a polygon or a segment, any multiple of its area or length.
  Integer content = 0;
  // The sum of d s.
  IntegerVector first = {0, 0, 0};
  // The sum of d (a a' + b b' + c c' + s s').
  std::array<Integer, 6> second = {0, 0, 0, 0, 0, 0};
};

class SurfaceSum {
 public:
  SurfaceSum(const Hull& hull, const std::function<bool()>& should_stop)
      : hull_(hull), poll_(should_stop, kTrianglesPerPoll) {}

  absl::StatusOr<HullProperties> Run() {
    exponent_ = kAboveAllExponents;
    for (const Vector& p : hull_.vertices()) {
      if (poll_.Step()) return Stopped();
      exponent_ = LowestBitExponent(p, exponent_);
    }
    origin_ = ToInteger(hull_.vertices()[0], exponent_);
    if (hull_.dimension() < 2) {
      moments_.content = 1;
      moments_.first = At(static_cast<uint32_t>(hull_.vertices().size()) - 1);
    }
    for (size_t f = 0; f < hull_.facet_count(); ++f) {
      if (!AddFacet(hull_.facet(f))) return Stopped();
    }
    return Properties();
  }

 private:
  static absl::Status Stopped() {
    return absl::CancelledError("computing the properties was cancelled");
  }

  // Returns a vertex relative to the first.
  IntegerVector At(uint32_t i) const { return ToInteger(hull_.vertices()[i], exponent_) - origin_; }

  // Adds a fan of triangles. Returns false if should_stop returned true.
  bool AddFacet(std::span<const uint32_t> facet) {
    const IntegerVector a = At(facet[0]);
    IntegerVector b = At(facet[1]);
    // Twice the area, as a vector.
    IntegerVector normal = {0, 0, 0};
    for (size_t i = 2; i < facet.size(); ++i) {
      if (poll_.Step()) return false;
      const IntegerVector c = At(facet[i]);
      const IntegerVector n = Cross(b - a, c - a);
      normal = normal + n;
      if (hull_.dimension() == 3) {
        AddTetrahedron(Dot(n, a), a, b, c);
      } else {
        // All n are positive multiples of the first, and so are their products with it.
        const Integer d = Dot(n, i == 2 ? n : first_normal_);
        if (i == 2) first_normal_ = n;
        moments_.content += d;
        moments_.first = moments_.first + d * (a + b + c);
      }
      b = c;
    }
    AddArea(Dot(normal, normal));
    return true;
  }

  void AddTetrahedron(const Integer& d, const IntegerVector& a, const IntegerVector& b,
                      const IntegerVector& c) {
    if (d.is_zero()) return;
    const IntegerVector s = a + b + c;
    moments_.content += d;
    moments_.first = moments_.first + d * s;
    for (size_t k = 0; k < 6; ++k) {
      const auto [i, j] = kEntries[k];
      moments_.second[k] += d * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
    }
  }

  // Adds the square root of `square`, within a relative 2^-61: the integer root of its leading 128
  // bits or so. Requires: square > 0.
  void AddArea(const Integer& square) {
    const auto bits = static_cast<int>(msb(square)) + 1;
    // Even.
    const int shift = (kAreaBits - bits) & ~1;
    const Integer leading = shift >= 0 ? Integer(square << shift) : Integer(square >> -shift);
    // At most kAreaBits / 2 bits of a root are fractional.
    twice_area_ += Integer(sqrt(leading)) << (kAreaBits - shift) / 2;
  }

  HullProperties Properties() const {
    const auto& [content, first, second] = moments_;
    HullProperties properties = {};
    const Integer share = (hull_.dimension() + 1) * content;
    for (int i = 0; i < 3; ++i) {
      properties.centroid[i] = RoundToNearest(share * origin_[i] + first[i], share, exponent_);
    }
    const int sides = hull_.dimension() == 2 ? 2 : 1;
    properties.area = RoundRatio(sides * twice_area_, 2, 2 * exponent_ - kAreaBits / 2);
    if (hull_.dimension() < 3) return properties;
    properties.volume = RoundToNearest(content, 6, 3 * exponent_);
    // The integral of x_i x_j about the centroid, times 480 content.
    std::array<Integer, 6> central;
    for (size_t k = 0; k < 6; ++k) {
      const auto [i, j] = kEntries[k];
      central[k] = 4 * content * second[k] - 5 * first[i] * first[j];
    }
    for (size_t k = 0; k < 6; ++k) {
      const Integer entry =
          k < 3 ? central[(k + 1) % 3] + central[(k + 2) % 3] : Integer(-central[k]);
      properties.inertia[k] = RoundToNearest(entry, 480 * content, 5 * exponent_);
    }
    return properties;
  }

  static constexpr int kAreaBits = 128;

  const Hull& hull_;
  StopPoll poll_;
  // Coordinates are integers times 2^exponent_.
  int exponent_ = 0;
  IntegerVector origin_;
  IntegerVector first_normal_;
  Moments moments_;
  // The sum of the facets' areas, times 2^(1 + kAreaBits / 2).
  Integer twice_area_ = 0;
};

}  // namespace

absl::StatusOr<HullProperties> ComputeProperties(const Hull& hull,
                                                 const std::function<bool()>& should_stop) {
  HULLD_CHECK(!hull.empty());
  return SurfaceSum(hull, should_stop).Run();
}

}  // namespace hulld
