#include "core/query/certification.h"

#include <absl/status/status.h>

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/rational.h"
#include "core/query/exact/exact_nearest.h"

namespace hulld {
namespace {

// Returns the sign of the maximum of n.(a - b).
int SignOfSupport(ExactPair& pair, const IntegerVector& n) {
  return Sign(Dot(n, pair.Farthest(n).w));
}

// Returns n divided by the greatest common divisor of its components.
IntegerVector Reduced(const IntegerVector& n) {
  const Integer divisor = gcd(gcd(abs(n.x), abs(n.y)), abs(n.z));
  return {n.x / divisor, n.y / divisor, n.z / divisor};
}

IntegerVector ExactlyOf(const Vector& n) {
  return ToInteger(n, LowestBitExponent(n, kAboveAllExponents));
}

// Returns n in the shortest form for which `proves` holds. Requires: it holds for n.
template <typename Proves>
ExactDirection Shortest(const IntegerVector& n, const Proves& proves) {
  IntegerVector reduced = Reduced(n);
  // A power of two scales the components to at most 2, for readability.
  const Vector rounded = ToScaledDoubles(reduced) * 0x1p-62;
  if (proves(ExactlyOf(rounded))) return rounded;
  return reduced;
}

// Returns the sign of the gap between the cores along n minus the sum of the radii.
int CompareGap(ExactPair& pair, const IntegerVector& n, const ScaledInteger& radii) {
  const Integer gap = -Dot(n, pair.Farthest(n).w);
  if (Sign(gap) < 0) return -1;
  return CompareSquareRoot(gap * gap, pair.norm() * pair.norm() * Dot(n, n), pair.exponent(),
                           radii);
}

// Finds vertices of A - B that surround the origin.
class Surrounding {
 public:
  Surrounding(ExactPair& pair, const std::function<bool()>& should_stop)
      : pair_(pair), poll_(should_stop, 1) {}

  // Repeatedly takes a half-space that contains all vertices found and has the origin on its
  // boundary, and adds the farthest vertex outside it. When no half-space of this kind remains,
  // drops every vertex that is not needed. At most six remain (Steinitz 1913). Requires: the origin
  // strictly inside A - B.
  absl::StatusOr<std::vector<VertexPair>> Find() {
    while (const std::optional<IntegerVector> n = Escape(corners_)) {
      if (poll_.Step()) return absl::CancelledError("finding the certificate was cancelled");
      corners_.push_back(pair_.Farthest(*n));
      if (pair_.stopped()) return absl::CancelledError("finding the certificate was cancelled");
      // If the origin is strictly inside, the farthest vertex is outside the half-space.
      HULLD_CHECK(Sign(Dot(*n, corners_.back().w)) > 0);
    }
    for (size_t i = corners_.size(); i-- > 0;) {
      std::vector<ExactCorner> fewer = corners_;
      fewer.erase(fewer.begin() + i);
      if (!Escape(fewer)) corners_ = std::move(fewer);
    }
    std::vector<VertexPair> pairs;
    for (const ExactCorner& corner : corners_) pairs.push_back(corner.pair);
    return pairs;
  }

 private:
  // Returns a non-zero direction n with n.w <= 0 for all corners, or none if the origin is strictly
  // inside their hull. These directions form a cone. If the corners span R^3, its extreme rays are
  // cross products of two corners; if they span a plane, so is the plane's normal. The result is in
  // the middle of the cone: the sum of its rays, scaled to about equal lengths. The corner found
  // along it cuts the cone deeply, so few corners are needed.
  static std::optional<IntegerVector> Escape(const std::vector<ExactCorner>& corners) {
    bool parallel = true;
    std::vector<IntegerVector> rays;
    for (size_t i = 0; i < corners.size(); ++i) {
      for (size_t j = i + 1; j < corners.size(); ++j) {
        const IntegerVector n = Cross(corners[i].w, corners[j].w);
        if (IsZero(n)) continue;
        parallel = false;
        bool below = true;
        bool above = true;
        for (size_t k = 0; k < corners.size() && (below || above); ++k) {
          const int sign = Sign(Dot(n, corners[k].w));
          below &= sign <= 0;
          above &= sign >= 0;
        }
        if (below && above) return n;
        if (below) rays.push_back(n);
        if (above) rays.push_back(-n);
      }
    }
    if (!rays.empty()) return Middle(rays);
    if (!parallel) return std::nullopt;
    for (const ExactCorner& corner : corners) {
      if (!IsZero(corner.w)) return AnyPerpendicular(corner.w);
    }
    return IntegerVector{1, 0, 0};
  }

  // Returns the sum of the rays, each scaled by a power of two to about the length of the longest.
  static IntegerVector Middle(const std::vector<IntegerVector>& rays) {
    unsigned longest = 0;
    for (const IntegerVector& ray : rays) longest = std::max(longest, BitLength(ray));
    IntegerVector sum = {0, 0, 0};
    for (const IntegerVector& ray : rays) {
      sum = sum + (Integer(1) << (longest - BitLength(ray))) * ray;
    }
    return sum;
  }

  ExactPair& pair_;
  StopPoll poll_;
  std::vector<ExactCorner> corners_;
};

}  // namespace

absl::StatusOr<Certificate> MakeCertificate(ExactPair& exact, const Decision& decision,
                                            const std::function<bool()>& should_stop) {
  HULLD_CHECK(decision.relation != Relation::kWithinTolerance);
  Certificate certificate;
  certificate.direction = decision.axis;
  if (const IntegerVector* n = std::get_if<IntegerVector>(&decision.axis)) {
    const int sign = decision.relation == Relation::kSeparated ? -1 : 0;
    certificate.direction = Shortest(
        *n, [&](const IntegerVector& short_n) { return SignOfSupport(exact, short_n) <= sign; });
    if (exact.stopped()) return absl::CancelledError("finding the certificate was cancelled");
  }
  const std::span<const VertexPair> known(decision.pairs.data(), decision.pair_count);
  if (decision.relation == Relation::kTouching) {
    absl::StatusOr<ExactNearest> nearest = FindNearestExactly(exact, known, should_stop);
    if (!nearest.ok()) return nearest.status();
    certificate.pairs = std::move(nearest->point.pairs);
  } else if (decision.relation == Relation::kOverlapping) {
    if (!known.empty()) {
      certificate.pairs.assign(known.begin(), known.end());
      return certificate;
    }
    absl::StatusOr<std::vector<VertexPair>> pairs = Surrounding(exact, should_stop).Find();
    if (!pairs.ok()) return pairs.status();
    certificate.pairs = *std::move(pairs);
  }
  return certificate;
}

absl::StatusOr<Certificate> MakeRoundedCertificate(ExactPair& exact, Relation relation,
                                                   const Vector& hint,
                                                   std::span<const VertexPair> seed,
                                                   const std::function<bool()>& should_stop) {
  HULLD_CHECK(relation != Relation::kWithinTolerance);
  const ScaledInteger radii = exact.filter().RadiiPlus(0).Exact();
  Certificate certificate;
  const auto proves = [&](const IntegerVector& n) {
    return CompareGap(exact, n, radii) >= (relation == Relation::kSeparated ? 1 : 0);
  };
  if (relation == Relation::kSeparated && !hint.isZero()) {
    const bool is_proof = proves(ExactlyOf(hint));
    if (exact.stopped()) return absl::CancelledError("finding the certificate was cancelled");
    if (is_proof) {
      certificate.direction = hint;
      return certificate;
    }
  }
  absl::StatusOr<ExactNearest> nearest = FindNearestExactly(exact, seed, should_stop);
  if (!nearest.ok()) return nearest.status();
  if (relation != Relation::kOverlapping) {
    certificate.direction = Shortest(-PointOf(exact, nearest->point), proves);
    if (exact.stopped()) return absl::CancelledError("finding the certificate was cancelled");
  }
  if (relation != Relation::kSeparated) certificate.pairs = std::move(nearest->point.pairs);
  return certificate;
}

}  // namespace hulld
