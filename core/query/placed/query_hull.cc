#include "core/query/placed/query_hull.h"

#include <absl/status/status.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/ieee_arithmetic.h"
#include "core/query/placed/live_parts.h"

namespace hulld {

QueryHull::QueryHull(const Hull& hull, const std::function<bool()>& should_stop)
    : canonical_(&hull) {
  HULLD_CHECK(HasIeeeArithmetic());
  if (hull.empty()) return;
  auto base = std::make_shared<const HullBase>(hull, should_stop);
  dimension_ = hull.dimension();
  point_count_ = static_cast<uint32_t>(base->points().size());
  exponent_ = base->exponent();
  max_abs_ = base->max_abs_coordinate();
  radius_ = base->radius();
  center_ = base->center();
  base_ = std::move(base);
}

absl::StatusOr<QueryHull> QueryHull::Prepare(const Hull& hull,
                                             const std::function<bool()>& should_stop) {
  QueryHull prepared(hull, should_stop);
  if (!prepared.empty() && prepared.base_->support().stopped()) {
    return absl::CancelledError("preparing the hull was cancelled");
  }
  return prepared;
}

Vector QueryHull::GrownPoint(uint32_t i) const {
  size_t at = i - base_->points().size();
  for (const auto& level : growth_->parts->levels) {
    if (at < level->mapped.points.size()) return level->mapped.points[at];
    at -= level->mapped.points.size();
  }
  HULLD_DCHECK(at < growth_->tail_count);
  return growth_->parts->tail->point(at);
}

SupportPoint QueryHull::FartherInGrowth(const PlainVector& n, SupportPoint found) const {
  const LiveParts& parts = *growth_->parts;
  auto first = static_cast<uint32_t>(base_->points().size());
  const auto consider = [&](const SupportPoint& other) {
    if (other.value > found.value) found = {first + other.vertex, other.value};
  };
  for (const auto& level : parts.levels) {
    consider(level->mapped.support.Farthest(n));
    first += static_cast<uint32_t>(level->mapped.points.size());
  }
  if (growth_->tail_count > 0) consider(parts.tail->Farthest(growth_->tail_count, n));
  if (growth_->scans > 0) {
    // Batches the updates because incrementing a counter shared by all threads is expensive.
    constexpr uint32_t kBetween = 16;
    thread_local uint32_t queries = 0;
    if (++queries % kBetween == 0) {
      growth_->scanned->fetch_add(kBetween * growth_->scans, std::memory_order_relaxed);
    }
  }
  return found;
}

CenterBounds::Bounds QueryHull::BoundsWithGrowth(CenterBounds::Bounds bounds,
                                                 const PlainVector& n) const {
  const double reach = Farthest(n).value - Dot(n, PlainVector(center_));
  const double margin = kCenterMargin * radius_ * LargestComponent(n);
  // NaN if the base's is unknown.
  bounds.support = std::max(bounds.support, reach + margin);
  return bounds;
}

std::vector<uint32_t> QueryHull::Candidates(const PlainVector& n, double error,
                                            double slack) const {
  std::vector<uint32_t> candidates;
  const double least = Farthest(n).value - slack;
  base_->support().AppendCandidates(n, error, least, 0, candidates);
  if (growth_ == nullptr) return candidates;
  const LiveParts& parts = *growth_->parts;
  auto first = static_cast<uint32_t>(base_->points().size());
  for (const auto& level : parts.levels) {
    level->mapped.support.AppendCandidates(n, error, least, first, candidates);
    first += static_cast<uint32_t>(level->mapped.points.size());
  }
  for (uint32_t i = 0; i < growth_->tail_count; ++i) {
    const Vector p = parts.tail->point(i);
    if (SupportValue(n, p.x(), p.y(), p.z()) >= least) candidates.push_back(first + i);
  }
  return candidates;
}

}  // namespace hulld
