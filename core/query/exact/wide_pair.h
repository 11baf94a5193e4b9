#ifndef HULLD_CORE_QUERY_EXACT_WIDE_PAIR_H_
#define HULLD_CORE_QUERY_EXACT_WIDE_PAIR_H_

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/check.h"
#include "core/base/scan_poll.h"
#include "core/hull/hull.h"
#include "core/numeric/integer.h"
#include "core/numeric/wide_integer.h"
#include "core/query/exact/exact_frame.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// An ExactPair in integers of a fixed width, without allocation, for searches of the relation
// alone. The coordinates are the same integers.
//
// Widths (**proven**): let world coordinates be below 2^c, c = SmallFrame::bits <= 64 kWords - 9.
// - Vertices of A - B are below 2^(c + 1), thickened ones (portal_search.h) below 2^(c + 4), and
//   their differences below 2^(c + 5).
// - The ray, with sums of at most ten vertices times at most ten, is below 200 * 2^c < 2^(c + 8):
//   kWords hold it.
// - A cross product of the ray and a difference is below 2 * 2^(2 c + 13), one of two differences
//   below 2 * 2^(2 c + 10): 2 kWords hold them, 2 c + 14 <= 128 kWords - 4.
// - Its product with a difference of vertices is below 3 * 2^(3 c + 19) < 2^(3 c + 21) <=
//   2^(192 kWords - 6): 3 kWords hold it.
template <int kWords>
class WidePair {
 public:
  using Number = WideInteger<kWords>;
  using Coordinates = WideVector<kWords>;
  using Direction = WideVector<2 * kWords>;

  static bool Fits(const SmallFrame& frame) {
    return WordsFor(frame.bits) <= kWords && frame.a.own_bits <= kMaxOwnBits &&
           frame.b.own_bits <= kMaxOwnBits;
  }

  // Requires: Fits(frame), and the frame of `filter`. `filter` and should_stop, which may be empty,
  // must outlive the pair. Scans of many vertices poll should_stop; after stopped(), their results
  // are meaningless.
  WidePair(const FloatPair& filter, const SmallFrame& frame,
           const std::function<bool()>& should_stop)
      : filter_(&filter), poll_(should_stop), a_(filter.a(), frame.a), b_(filter.b(), frame.b) {
    HULLD_DCHECK(Fits(frame));
    const WideInteger<2> norm_a = WideOf(frame.a.rotation.norm);
    const WideInteger<2> norm_b = WideOf(frame.b.rotation.norm);
    SetRows(frame, frame.a, norm_b, a_);
    SetRows(frame, frame.b, norm_a, b_);
    for (int i = 0; i < 3; ++i) a_.shift[i] = 0;
    if (filter.a().product() != nullptr || filter.b().product() != nullptr) [[unlikely]] {
      ShiftByProducts(frame);
      return;
    }
    Number norm(norm_a);
    if (frame.a.times_other_norm) norm = LowProduct<kWords>(norm, norm_b);
    const Vector& t_A = filter.a().X_WH().t;
    const Vector& t_B = filter.b().X_WH().t;
    for (int i = 0; i < 3; ++i) {
      const Number step = WideIntegerOf<kWords>(t_B[i], frame.exponent) -
                          WideIntegerOf<kWords>(t_A[i], frame.exponent);
      b_.shift[i] = LowProduct<kWords>(norm, step);
    }
  }

  const FloatPair& filter() const { return *filter_; }
  bool stopped() const { return poll_.stopped(); }
  const QueryHull& a() const { return a_.placed->query_hull(); }
  const QueryHull& b() const { return b_.placed->query_hull(); }

  Coordinates VertexA(uint32_t i) { return a_.Vertex(i); }
  Coordinates VertexB(uint32_t i) { return b_.Vertex(i); }
  Coordinates Difference(VertexPair pair) { return VertexA(pair.a) - VertexB(pair.b); }

  // Return the lowest of the vertices of A that are farthest along n, and of the vertices of B that
  // are farthest against n. `candidates`: ascending vertices that are known to include the result.
  uint32_t FarthestA(const Direction& n) {
    CandidateBuffer buffer;
    return a_.Farthest(n,
                       CandidatesOf(a_, n,
                                    [&](const Vector& n_W, double error) {
                                      return filter_->CandidatesA(n_W, error, buffer);
                                    }),
                       poll_);
  }
  uint32_t FarthestB(const Direction& n) {
    CandidateBuffer buffer;
    return b_.Farthest(-n,
                       CandidatesOf(b_, n,
                                    [&](const Vector& n_W, double error) {
                                      return filter_->CandidatesB(n_W, error, buffer);
                                    }),
                       poll_);
  }
  uint32_t FarthestA(const Direction& n, std::span<const uint32_t> candidates) {
    return a_.Farthest(n, candidates, poll_);
  }
  uint32_t FarthestB(const Direction& n, std::span<const uint32_t> candidates) {
    return b_.Farthest(-n, candidates, poll_);
  }

  // Return all candidates farthest along n, or against it; poll `poll`. Thread-safe, because they
  // cache no vertices.
  std::vector<uint32_t> FeatureA(const Direction& n, std::span<const uint32_t> candidates,
                                 ScanPoll& poll) const {
    return a_.Feature(n, candidates, poll);
  }
  std::vector<uint32_t> FeatureB(const Direction& n, std::span<const uint32_t> candidates,
                                 ScanPoll& poll) const {
    return b_.Feature(-n, candidates, poll);
  }

  // Returns a positive multiple of a point in the relative interior of A - B (see ExactPair).
  Coordinates CenterDifference() const {
    Coordinates difference;
    const Coordinates sum_a = a_.SumOfInnerVertices();
    const Coordinates sum_b = b_.SumOfInnerVertices();
    for (int i = 0; i < 3; ++i) {
      difference[i] = LowProduct<kWords>(sum_a[i], b_.InnerCount()) -
                      LowProduct<kWords>(sum_b[i], a_.InnerCount());
    }
    return difference;
  }

  static Direction ToDirection(const Coordinates& n) {
    return {WideInteger<2 * kWords>(n.x), WideInteger<2 * kWords>(n.y),
            WideInteger<2 * kWords>(n.z)};
  }

 private:
  // Own coordinates of at most this many bits fit in one word, and so do sums of ten of them.
  static constexpr int kOneWordBits = 59;
  static constexpr int kMaxOwnBits = kWords == 1 ? kOneWordBits : kOneWordBits + 64;
  // Exponents of at most this magnitude have a normal power of two and an inverse.
  static constexpr int kMaxScaled = 1000;
  // Number of vertices, from the first on, that are cached after they are multiplied out.
  static constexpr uint32_t kKept = 32;

  struct Side {
    Side(const PlacedHull& hull, const SmallFrame::Side& frame)
        : placed(&hull),
          exponent(frame.exponent),
          per_unit(std::abs(exponent) <= kMaxScaled ? std::ldexp(1.0, -exponent) : 0),
          is_narrow(frame.own_bits <= kOneWordBits) {}

    template <int kOwnWords>
    Coordinates Rotated(const WideVector<kOwnWords>& own) const {
      Coordinates result;
      for (int i = 0; i < 3; ++i) {
        result[i] = LowProduct<kWords>(rows[i].x, own.x) + LowProduct<kWords>(rows[i].y, own.y) +
                    LowProduct<kWords>(rows[i].z, own.z);
      }
      return result;
    }

    template <int kOwnWords>
    WideVector<kOwnWords> Own(uint32_t i) const {
      const Vector v = placed->query_hull().point(i);
      if constexpr (kOwnWords == 1) {
        // The product is an integer below 2^kOneWordBits, so it is exact.
        const auto own = [&](double x) { return static_cast<int64_t>(x * per_unit); };
        if (per_unit != 0) return {own(v.x()), own(v.y()), own(v.z())};
      }
      return {WideIntegerOf<kOwnWords>(v.x(), exponent), WideIntegerOf<kOwnWords>(v.y(), exponent),
              WideIntegerOf<kOwnWords>(v.z(), exponent)};
    }

    Coordinates MakeVertex(uint32_t i) const {
      return (is_narrow ? Rotated(Own<1>(i)) : Rotated(Own<2>(i))) + shift;
    }

    Coordinates Vertex(uint32_t i) {
      if (i >= kKept) return MakeVertex(i);
      if ((known >> i & 1) == 0) {
        kept[i] = MakeVertex(i);
        known |= uint32_t{1} << i;
      }
      return kept[i];
    }

    // An empty `candidates` means all vertices.
    uint32_t Farthest(const Direction& n, std::span<const uint32_t> candidates, ScanPoll& poll) {
      if (candidates.size() == 1) return candidates[0];
      uint32_t best = candidates.empty() ? 0 : candidates[0];
      auto largest = Dot(n, Vertex(best));
      if (candidates.empty()) {
        for (uint32_t i = 1; i < vertex_count() && !poll.StopsAfter(i); ++i) {
          Consider(n, i, best, largest);
        }
      } else {
        for (size_t k = 1; k < candidates.size() && !poll.StopsAfter(k); ++k) {
          Consider(n, candidates[k], best, largest);
        }
      }
      return best;
    }
    uint32_t vertex_count() const { return placed->query_hull().point_count(); }
    void Consider(const Direction& n, uint32_t i, uint32_t& best,
                  WideInteger<3 * kWords>& largest) {
      const auto value = Dot(n, Vertex(i));
      if (Sign(value - largest) <= 0) return;
      best = i;
      largest = value;
    }

    std::vector<uint32_t> Feature(const Direction& n, std::span<const uint32_t> candidates,
                                  ScanPoll& poll) const {
      std::vector<uint32_t> farthest;
      WideInteger<3 * kWords> largest(0);
      size_t seen = 0;
      for (const uint32_t i : candidates) {
        if (poll.StopsAfter(++seen)) break;
        const auto value = Dot(n, MakeVertex(i));
        const int order = farthest.empty() ? 1 : Sign(value - largest);
        if (order < 0) continue;
        if (order > 0) {
          farthest.clear();
          largest = value;
        }
        farthest.push_back(i);
      }
      return farthest;
    }

    WideInteger<1> InnerCount() const {
      return static_cast<int64_t>(placed->query_hull().inner_points().size());
    }
    template <int kOwnWords>
    Coordinates RotatedSum() const {
      WideVector<kOwnWords> own = {0, 0, 0};
      for (const uint32_t i : placed->query_hull().inner_points()) own = own + Own<kOwnWords>(i);
      return Rotated(own);
    }
    Coordinates SumOfInnerVertices() const {
      Coordinates sum = is_narrow ? RotatedSum<1>() : RotatedSum<2>();
      for (int i = 0; i < 3; ++i) sum[i] += LowProduct<kWords>(shift[i], InnerCount());
      return sum;
    }

    const PlacedHull* placed;
    int exponent;
    // 2^-exponent, or 0 if that may not be a normal double.
    double per_unit;
    bool is_narrow;
    // world = rows * own + shift.
    std::array<Coordinates, 3> rows;
    Coordinates shift;
    // Bit set of valid elements of `kept`.
    uint32_t known = 0;
    std::array<Coordinates, kKept> kept;
  };

  // Returns the candidates of a large hull that floating point cannot exclude. For a small hull,
  // returns an empty list, which means all vertices.
  template <typename Candidates>
  std::span<const uint32_t> CandidatesOf(const Side& side, const Direction& n,
                                         Candidates candidates) const {
    if (side.vertex_count() <= kKept || !filter_->usable() || IsZero(n)) return {};
    const Vector n_W = ToScaledDoubles(ToInteger(n));
    return candidates(n_W, kScaledDoublesError * LargestComponent(n_W));
  }

  static void SetRows(const SmallFrame& frame, const SmallFrame::Side& from,
                      const WideInteger<2>& other_norm, Side& side) {
    const int shift = from.exponent - frame.exponent;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        Number entry(WideOf(from.rotation.rows[i][j]));
        if (from.times_other_norm) entry = LowProduct<kWords>(entry, other_norm);
        side.rows[i][j] = shift == 0 ? entry : Shifted(entry, shift);
      }
    }
  }

  static Coordinates WideCoordinates(const Vector& t, int exponent) {
    return {WideIntegerOf<kWords>(t.x(), exponent), WideIntegerOf<kWords>(t.y(), exponent),
            WideIntegerOf<kWords>(t.z(), exponent)};
  }

  // Returns the norm of a hull's rotation times its translation over 2^exponent. For a piece P of a
  // body B with norms n_P and n_B: n_P (rows_B t_P + n_B t_B).
  static Coordinates ScaledTranslation(const PlacedHull& placed, const SmallFrame::Side& side,
                                       int exponent) {
    Coordinates scaled;
    const PoseProduct* const product = placed.product();
    if (product == nullptr) {
      const Coordinates t = WideCoordinates(placed.X_WH().t, exponent);
      for (int i = 0; i < 3; ++i) {
        scaled[i] = LowProduct<kWords>(WideOf(side.rotation.norm), t[i]);
      }
      return scaled;
    }
    SmallRotation body, piece;
    HULLD_CHECK(FindSmallRotation(product->X_WB().q, body) &&
                FindSmallRotation(product->X_BP().q, piece));
    const Coordinates t_B = WideCoordinates(product->X_WB().t, exponent);
    const Coordinates t_P = WideCoordinates(product->X_BP().t, exponent);
    for (int i = 0; i < 3; ++i) {
      const Number sum = LowProduct<kWords>(WideOf(body.rows[i][0]), t_P.x) +
                         LowProduct<kWords>(WideOf(body.rows[i][1]), t_P.y) +
                         LowProduct<kWords>(WideOf(body.rows[i][2]), t_P.z) +
                         LowProduct<kWords>(WideOf(body.norm), t_B[i]);
      scaled[i] = LowProduct<kWords>(WideOf(piece.norm), sum);
    }
    return scaled;
  }

  // Computes b_.shift if a pose is a product of two.
  void ShiftByProducts(const SmallFrame& frame) {
    Coordinates of_a = ScaledTranslation(filter_->a(), frame.a, frame.exponent);
    Coordinates of_b = ScaledTranslation(filter_->b(), frame.b, frame.exponent);
    for (int i = 0; i < 3; ++i) {
      if (frame.a.times_other_norm) {
        of_a[i] = LowProduct<kWords>(of_a[i], WideOf(frame.b.rotation.norm));
        of_b[i] = LowProduct<kWords>(of_b[i], WideOf(frame.a.rotation.norm));
      }
      b_.shift[i] = of_b[i] - of_a[i];
    }
  }

  const FloatPair* filter_;
  ScanPoll poll_;
  Side a_;
  Side b_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_WIDE_PAIR_H_
