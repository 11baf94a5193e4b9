#include "core/query/ladder.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/numeric/error_bounds.h"
#include "core/query/exact_pair.h"
#include "core/query/exact_search.h"
#include "core/query/float_search.h"

namespace hulld {
namespace {

// Whether spheres round the hulls show that they are separated; then along n, which leads from A's
// centre to B's.
bool SpheresSeparate(const FloatPair& pair, const PlainVector& n) {
  const double reach = pair.a().query_hull().radius() + pair.b().query_hull().radius() +
                       kSphereErrorFactor * pair.size();
  return SquaredNorm(n) > reach * reach * kSphereSquareRoundUp;
}

// What the hulls' bounds about their centres show along n, which leads from A's centre to B's: that
// n separates them, or that the segment between the centres is covered by their insides.
std::optional<Relation> CompareOnCenterLine(const FloatPair& pair, const PlainVector& n) {
  const double largest = LargestComponent(n);
  if (!(largest >= kDirectionMin && largest <= kDirectionMax)) return std::nullopt;
  // Where one is unknown, no comparison holds.
  const CenterBounds::Bounds a = pair.CenterBoundsA(n);
  const CenterBounds::Bounds b = pair.CenterBoundsB(n);
  if (a.support + b.support + kCenterSupportFactor * largest * pair.size() < SquaredNorm(n)) {
    return Relation::kSeparated;
  }
  const double error = kCenterGaugeFactor * pair.size();
  const double gauge_a = a.gauge + error * pair.a().query_hull().center_bounds().largest_gauge();
  const double gauge_b = b.gauge + error * pair.b().query_hull().center_bounds().largest_gauge();
  if (gauge_a * gauge_b * kCenterProductRoundUp < gauge_a + gauge_b) return Relation::kOverlapping;
  return std::nullopt;
}

Relation RelationOf(FloatVerdict verdict) {
  switch (verdict) {
    case FloatVerdict::kOverlapping:
      return Relation::kOverlapping;
    case FloatVerdict::kWithinTolerance:
      return Relation::kWithinTolerance;
    case FloatVerdict::kSeparated:
    case FloatVerdict::kUndecided:
      break;
  }
  return Relation::kSeparated;
}

void Accept(const FloatSearchResult& found, Rung rung, Decision& decision) {
  decision.relation = RelationOf(found.verdict);
  decision.rung = rung;
  if (found.verdict == FloatVerdict::kSeparated) decision.axis = found.axis;
  if (found.verdict == FloatVerdict::kOverlapping) {
    decision.pair_count = found.pair_count;
    decision.pairs = found.pairs;
  }
}

// What the next query of the pair may try first.
void Remember(const FloatSearchResult& found, PairCache& cache) {
  cache = PairCache();
  if (found.verdict == FloatVerdict::kSeparated) cache.axis = found.axis;
  if (found.verdict == FloatVerdict::kOverlapping) {
    cache.pair_count = found.pair_count;
    std::copy(found.pairs.begin(), found.pairs.end(), cache.pairs);
  }
}

}  // namespace

absl::StatusOr<Decision> Decide(const FloatPair& pair, double tolerance, PairCache* cache,
                                Purpose purpose, const std::function<bool()>& should_stop) {
  Decision decision;
  if (pair.usable()) {
    const PlainVector n = -pair.CenterDifference();
    if (SpheresSeparate(pair, n)) {
      decision.axis = Vector(n);
      return decision;
    }
    if (cache != nullptr) {
      const FloatSearchResult found = TryCached(pair, *cache);
      decision.directions_tried += found.directions_tried;
      if (found.verdict != FloatVerdict::kUndecided) {
        Accept(found, Rung::kCached, decision);
        return decision;
      }
    }
    if (purpose == Purpose::kRelation) {
      if (const std::optional<Relation> relation = CompareOnCenterLine(pair, n)) {
        decision.relation = *relation;
        if (*relation == Relation::kSeparated) decision.axis = Vector(n);
        return decision;
      }
    }
    const FloatSearchResult found = SearchInFloatingPoint(pair, tolerance);
    decision.directions_tried += found.directions_tried;
    if (cache != nullptr) Remember(found, *cache);
    if (found.verdict != FloatVerdict::kUndecided) {
      Accept(found, Rung::kFloatingPoint, decision);
      return decision;
    }
  }
  ExactPair exact(pair);
  absl::StatusOr<ExactSearchResult> found = SearchExactly(exact, should_stop);
  if (!found.ok()) return found.status();
  decision.relation = found->relation;
  decision.rung = Rung::kExact;
  decision.directions_tried += found->directions_tried;
  if (found->axis) decision.axis = *std::move(found->axis);
  decision.pair_count = static_cast<uint32_t>(found->pairs.size());
  std::copy(found->pairs.begin(), found->pairs.end(), decision.pairs.begin());
  return decision;
}

}  // namespace hulld
