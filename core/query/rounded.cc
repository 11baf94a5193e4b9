#include "core/query/rounded.h"

#include <absl/status/statusor.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/rational.h"
#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_distance.h"
#include "core/query/floating/float_search.h"
#include "core/query/terms/length_sum.h"

namespace hulld {
namespace {

class RoundedSearch {
 public:
  RoundedSearch(const FloatPair& pair, double tolerance, Decision& decision)
      : pair_(pair), radii_(pair.RadiiPlus(0)), tolerance_(tolerance), decision_(decision) {}

  // Tries all rungs before exact arithmetic. Requires: pair.usable().
  bool DecideInFloatingPoint(PairCache* cache) {
    const PlainVector n = -pair_.CenterDifference();
    if (CompareSpheres(n)) return true;
    if (cache != nullptr && TryCached(*cache)) return true;
    if (Walk(cache != nullptr && cache->axis ? *cache->axis : Vector(n), cache)) return true;
    return !(bounds_.low > 0) && FindOverlapOfCores(n, cache);
  }

  absl::Status DecideExactly(const std::function<bool()>& should_stop) {
    ExactPair exact(pair_, should_stop);
    const std::span<const VertexPair> seed(bounds_.point.pairs.data(), bounds_.point.count);
    const absl::StatusOr<ExactNearest> nearest = FindNearestExactly(exact, seed, should_stop);
    if (!nearest.ok()) return nearest.status();
    const int comparison =
        CompareSquareRoot(nearest->numerator, exact.norm() * exact.norm() * nearest->denominator,
                          exact.exponent(), radii_.Exact());
    Accept(comparison > 0    ? Relation::kSeparated
           : comparison == 0 ? Relation::kTouching
                             : Relation::kOverlapping,
           Rung::kExact);
    return absl::OkStatus();
  }

 private:
  bool Accept(Relation relation, Rung rung) {
    decision_.relation = relation;
    decision_.rung = rung;
    return true;
  }

  // Compares the distance of the centers, n being the vector from A's to B's, with the reach of the
  // rounded hulls from them, and with the radii alone.
  bool CompareSpheres(const PlainVector& n) {
    // kSphereSquareRoundUp also covers the rounding of the sum with the radii, u of it.
    const double reach = pair_.a().query_hull().radius() + pair_.b().query_hull().radius() +
                         kSphereErrorFactor * pair_.size() + radii_.high();
    if (SquaredNorm(n) > reach * reach * kSphereSquareRoundUp) {
      return Accept(Relation::kSeparated, Rung::kBounds);
    }
    // The difference of the centers is a point of A - B.
    if (Norm(n) + kCombinationErrorFactor * pair_.size() >= radii_.low()) return false;
    return Accept(Relation::kOverlapping, Rung::kBounds);
  }

  bool TryCached(const PairCache& cache) {
    ++decision_.directions_tried;
    if (cache.axis.has_value()) {
      return DistanceAlong(pair_, *cache.axis) > radii_.high() &&
             Accept(Relation::kSeparated, Rung::kCached);
    }
    if (cache.pair_count == 0) return false;
    const bool is_near = DistanceOfTriangle(pair_, cache.pairs) < radii_.low();
    if (!is_near && hulld::TryCached(pair_, cache).verdict != FloatVerdict::kOverlapping) {
      return false;
    }
    return Accept(Relation::kOverlapping, Rung::kCached);
  }

  // Bounds the distance of the cores until a bound shows the relation, or both are within the
  // tolerance of the radii.
  bool Walk(const Vector& first, PairCache* cache) {
    SeparationGoal goal;
    goal.threshold = radii_.value();
    goal.absolute_error = tolerance_ / 2;
    bounds_ = BoundDistance(pair_, first, {}, goal);
    ++decision_.directions_tried;
    if (cache != nullptr) cache->Clear();
    if (bounds_.low > radii_.high()) {
      if (cache != nullptr) {
        cache->axis = bounds_.point.count == 0 ? first : TowardOrigin(pair_, bounds_);
      }
      return Accept(Relation::kSeparated, Rung::kFloatingPoint);
    }
    if (bounds_.high < radii_.low()) {
      if (cache != nullptr) Remember(bounds_.point, *cache);
      return Accept(Relation::kOverlapping, Rung::kFloatingPoint);
    }
    return IsWithinTolerance() && Accept(Relation::kWithinTolerance, Rung::kFloatingPoint);
  }

  bool IsWithinTolerance() const {
    // If the cores overlap, 0 is not a lower bound on their separation.
    return bounds_.low > 0 &&
           std::nextafter(bounds_.high - radii_.low(), kInfinity) <= tolerance_ &&
           std::nextafter(radii_.high() - bounds_.low, kInfinity) <= tolerance_;
  }

  static void Remember(const FloatCombination& point, PairCache& cache) {
    cache.pair_count = 4;
    for (uint32_t i = 0; i < 4; ++i) cache.pairs[i] = point.pairs[i < point.count ? i : 0];
  }

  // The walk may surround the origin without noticing.
  bool FindOverlapOfCores(const PlainVector& n, PairCache* cache) {
    const FloatSearchResult found = SearchInFloatingPoint(pair_, 0, n);
    decision_.directions_tried += found.directions_tried;
    if (found.verdict != FloatVerdict::kOverlapping) return false;
    if (cache != nullptr) {
      cache->pair_count = 4;
      std::copy(found.pairs.begin(), found.pairs.end(), cache->pairs);
    }
    return Accept(Relation::kOverlapping, Rung::kFloatingPoint);
  }

  const FloatPair& pair_;
  const LengthSum radii_;
  const double tolerance_;
  Decision& decision_;
  SeparationBounds bounds_;
};

}  // namespace

absl::Status DecideRounded(const FloatPair& pair, double tolerance, PairCache* cache,
                           const std::function<bool()>& should_stop, Decision& decision) {
  HULLD_DCHECK(tolerance >= 0);
  RoundedSearch search(pair, tolerance, decision);
  if (pair.usable() && search.DecideInFloatingPoint(cache)) return absl::OkStatus();
  return search.DecideExactly(should_stop);
}

}  // namespace hulld
