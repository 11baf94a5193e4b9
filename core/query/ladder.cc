#include "core/query/ladder.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/expansion.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/exact/exact_search.h"
#include "core/query/exact/lattice_contact.h"
#include "core/query/floating/float_search.h"

namespace hulld {
namespace {

// Returns true if bounding spheres prove the hulls separated along n, the vector from A's center to
// B's.
bool SpheresSeparate(const FloatPair& pair, const PlainVector& n) {
  const double reach = pair.a().query_hull().radius() + pair.b().query_hull().radius() +
                       kSphereErrorFactor * pair.size();
  return SquaredNorm(n) > reach * reach * kSphereSquareRoundUp;
}

// Compares the bounds about the hulls' centers along n, the vector from A's center to B's. Returns
// SEPARATED if n separates the hulls, OVERLAPPING if their interiors cover the segment between the
// centers.
std::optional<Relation> CompareOnCenterLine(const FloatPair& pair, const PlainVector& n,
                                            const FloatPair::CenterView& view) {
  if (!view.known()) return std::nullopt;
  // If a bound is NaN, all comparisons fail.
  const CenterBounds::Bounds a = view.bounds_a();
  const CenterBounds::Bounds b = view.bounds_b();
  const double error = kCenterSupportFactor * LargestComponent(n) * pair.size();
  if (a.support + b.support + error < SquaredNorm(n)) return Relation::kSeparated;
  const double turn = kCenterGaugeFactor * pair.size();
  const double gauge_a = a.gauge + turn * pair.a().query_hull().center_bounds().largest_gauge();
  const double gauge_b = b.gauge + turn * pair.b().query_hull().center_bounds().largest_gauge();
  if (gauge_a * gauge_b * kCenterProductRoundUp < gauge_a + gauge_b) return Relation::kOverlapping;
  return std::nullopt;
}

// Returns true if bounds about the centers may settle a pair that spheres do not.
bool CentersMaySettle(const FloatPair& pair, const PlainVector& n) {
  const double largest = LargestComponent(n);
  if (!IsFilterDirection(largest)) return false;
  const QueryHull& a = pair.a().query_hull();
  const QueryHull& b = pair.b().query_hull();
  if (!a.center_bounds().coarse() && !b.center_bounds().coarse()) return true;
  // Coarse bounds settle little except overlaps of hulls with centers this close. Observed: of
  // random pairs of 8 vertices, they settle 1 % of the deep ones with centers farther apart, and
  // none that nearly touch.
  constexpr uint32_t kFewPoints = 8;
  const bool few = a.point_count() <= kFewPoints && b.point_count() <= kFewPoints;
  const double reach = (few ? 0.4 : 0.5) * (a.radius() + b.radius());
  return SquaredNorm(n) < reach * reach;
}

// Returns the relation if the bounds about the centers prove it. Otherwise sets `first` to the
// initial direction of the walk, from the normals of the surfaces between the centers; they
// indicate a gap better than the centers do. Leaves `first` unchanged if these normals are unknown
// or nearly cancel. Not inlined, to keep the path of distant pairs short.
[[gnu::noinline]] std::optional<Relation> CompareCenters(const FloatPair& pair,
                                                         const PlainVector& n, PlainVector& first) {
  constexpr double kMinSquaredNorm = 0x1p-4;
  if (!CentersMaySettle(pair, n)) return std::nullopt;
  const FloatPair::CenterView view = pair.ViewCenters(n);
  if (const std::optional<Relation> relation = CompareOnCenterLine(pair, n, view)) return relation;
  if (const PlainVector likely = view.LikelyAxis(); SquaredNorm(likely) > kMinSquaredNorm) {
    first = likely;
  }
  return std::nullopt;
}

Relation RelationOf(FloatVerdict verdict) {
  switch (verdict) {
    case FloatVerdict::kSeparated:
      return Relation::kSeparated;
    case FloatVerdict::kOverlapping:
      return Relation::kOverlapping;
    case FloatVerdict::kWithinTolerance:
      return Relation::kWithinTolerance;
    case FloatVerdict::kUndecided:
      break;
  }
  HULLD_UNREACHABLE();
}

void Accept(const FloatSearchResult& found, Rung rung, Purpose purpose, Decision& decision) {
  decision.relation = RelationOf(found.verdict);
  decision.rung = rung;
  if (purpose == Purpose::kRelation) return;
  if (found.verdict == FloatVerdict::kSeparated) decision.axis = found.axis;
  decision.reach = found.reach;
  decision.pair_count = found.pair_count;
  decision.pairs = found.pairs;
}

// Returns the relative pose; none for pieces of bodies, whose poses are products.
std::optional<RelativePose> RelativePoseOf(const FloatPair& pair) {
  if (pair.a().product() != nullptr || pair.b().product() != nullptr) return std::nullopt;
  const Pose& X_WA = pair.a().X_WH();
  const Pose& X_WB = pair.b().X_WH();
  RelativePose relative{X_WA.q, X_WB.q, {}, {}};
  for (int i = 0; i < 3; ++i) {
    const SumWithError offset = TwoSum(X_WB.t[i], -X_WA.t[i]);
    relative.offset[i] = offset.sum;
    relative.offset_rest[i] = offset.error;
  }
  return relative;
}

// Stores a suggestion for the next query of the pair.
void Remember(const FloatSearchResult& found, PairCache& cache) {
  cache.Clear();
  if (found.verdict == FloatVerdict::kSeparated) cache.axis = found.axis;
  if (found.verdict == FloatVerdict::kOverlapping) {
    cache.pair_count = found.pair_count;
    std::copy(found.pairs.begin(), found.pairs.end(), cache.pairs);
  }
}

// Stores the contact that an exact search found, or drops the suggestion if the hulls do not touch.
// `along`: the last direction of the search before it, the axis of a contact at a single vertex.
// Not inlined, to keep the path of other pairs short.
[[gnu::noinline]] void RememberContact(const FloatPair& pair, const Decision& decision,
                                       const PlainVector& along, PairCache& cache) {
  const bool touches = decision.relation == Relation::kTouching;
  const std::optional<RelativePose> pose = touches ? RelativePoseOf(pair) : std::nullopt;
  // The pairs of the cached contact are often those of this one.
  if (pose && cache.touching && cache.pair_count == 3 && decision.pair_count == 3 &&
      std::equal(cache.pairs, cache.pairs + 3, decision.pairs.begin())) {
    *cache.touching = *pose;
    return;
  }
  cache.Clear();
  if (!touches) return;
  if (pose) cache.touching = *pose;
  if (decision.pair_count == 0) return;
  const auto w = [&](int i) { return pair.Difference(decision.pairs[i]); };
  PlainVector n = Cross(w(1) - w(0), w(2) - w(0));
  const bool at_vertex =
      decision.pairs[0] == decision.pairs[1] && decision.pairs[1] == decision.pairs[2];
  if (at_vertex || Dot(n, along) < 0) n = at_vertex ? along : -n;
  if (!IsFilterDirection(LargestComponent(n))) return;
  cache.axis = n;
  cache.pair_count = at_vertex ? 1 : 3;
  std::copy(decision.pairs.begin(), decision.pairs.begin() + 3, cache.pairs);
}

// Tries the rungs between spheres and exact arithmetic. Returns false if none of them decides. `n`
// leads from A's center to B's; `found` receives the state in which the search ended, or the cached
// contact if that may still hold. Requires: pair.usable(). Not inlined, to keep the path of distant
// pairs short.
[[gnu::noinline]] bool DecideInFloatingPoint(const FloatPair& pair, const PlainVector& n,
                                             double tolerance, PairCache* cache, Purpose purpose,
                                             double max_error, FloatSearchResult& found,
                                             Decision& decision) {
  if (cache != nullptr) {
    // A tolerance or requested evidence needs more than the relation.
    const bool relation_alone = tolerance == 0 && purpose == Purpose::kRelation;
    if (cache->touching && relation_alone && RelativePoseOf(pair) == *cache->touching) {
      decision.relation = Relation::kTouching;
      decision.rung = Rung::kCached;
      return true;
    }
    const FloatSearchResult cached = TryCached(pair, *cache);
    decision.directions_tried += cached.directions_tried;
    if (cached.verdict != FloatVerdict::kUndecided) {
      Accept(cached, Rung::kCached, purpose, decision);
      return true;
    }
    if (cached.pair_count > 0 && relation_alone) {
      found = cached;
      return false;
    }
  }
  PlainVector first = n;
  if (purpose == Purpose::kRelation) {
    if (const std::optional<Relation> relation = CompareCenters(pair, n, first)) {
      decision.relation = *relation;
      // The cached suggestion failed, and retrying it would cost more than these bounds.
      if (cache != nullptr) cache->Clear();
      return true;
    }
  }
  // The point between the centers serves as a corner unless the search must report vertices, or it
  // is so near to the origin that rounding would dominate the next direction.
  constexpr double kMinDistance = 0x1p-10;
  const PlainVector inner = -n;
  const bool starts_inside = purpose == Purpose::kRelation && tolerance == 0 && cache == nullptr &&
                             LargestComponent(inner) > kMinDistance * pair.size();
  SearchInFloatingPoint(pair, tolerance, first, max_error, starts_inside ? &inner : nullptr, found);
  decision.directions_tried += found.directions_tried;
  if (cache != nullptr) Remember(found, *cache);
  if (found.verdict == FloatVerdict::kUndecided) return false;
  Accept(found, Rung::kFloatingPoint, purpose, decision);
  return true;
}

[[gnu::noinline]] absl::Status DecideExactly(const FloatPair& pair, const FloatSearchResult* end,
                                             Purpose purpose,
                                             const std::function<bool()>& should_stop,
                                             Decision& decision) {
  if (end != nullptr) {
    if (const std::optional<LatticeContact> contact = FindLatticeContact(pair, *end)) {
      decision.relation = Relation::kTouching;
      decision.rung = Rung::kExact;
      ++decision.directions_tried;
      decision.pair_count = 3;
      std::copy(contact->pairs.begin(), contact->pairs.end(), decision.pairs.begin());
      decision.axis = contact->axis;
      return absl::OkStatus();
    }
  }
  absl::StatusOr<ExactSearchResult> found =
      SearchExactly(pair, end, purpose != Purpose::kRelation, should_stop);
  if (!found.ok()) return found.status();
  decision.relation = found->relation;
  decision.rung = Rung::kExact;
  decision.directions_tried += found->directions_tried;
  decision.pair_count = found->pair_count;
  std::copy(found->pairs.begin(), found->pairs.end(), decision.pairs.begin());
  if (found->axis) decision.axis = *std::move(found->axis);
  return absl::OkStatus();
}

}  // namespace

absl::Status Decide(const FloatPair& pair, double tolerance, PairCache* cache, Purpose purpose,
                    double max_error, const std::function<bool()>& should_stop,
                    Decision& decision) {
  HULLD_DCHECK(tolerance >= 0);
  if (pair.usable()) {
    const PlainVector n = -pair.CenterDifference();
    if (SpheresSeparate(pair, n)) {
      if (purpose != Purpose::kRelation) decision.axis = Vector(n);
      return absl::OkStatus();
    }
    FloatSearchResult found;
    if (DecideInFloatingPoint(pair, n, tolerance, cache, purpose, max_error, found, decision)) {
      return absl::OkStatus();
    }
    const absl::Status status = DecideExactly(pair, &found, purpose, should_stop, decision);
    if (cache != nullptr && status.ok()) RememberContact(pair, decision, found.axis, *cache);
    return status;
  }
  return DecideExactly(pair, nullptr, purpose, should_stop, decision);
}

}  // namespace hulld
