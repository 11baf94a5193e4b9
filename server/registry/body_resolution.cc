#include "server/registry/body_resolution.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/hull/growth/hull_builder.h"
#include "server/contract/errors.h"
#include "server/contract/stopped_call.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/memory/served_hull.h"

namespace hulld::server {
namespace {

using Bodies = std::vector<std::shared_ptr<const Body>>;

// Returns the first piece with this hull.
size_t PieceWith(const Body& body, size_t hull) {
  size_t piece = 0;
  while (body.pieces()[piece].hull != hull) ++piece;
  return piece;
}

absl::Status WhyNoPiece(const Body& body, size_t hull, const absl::Status& cause) {
  const size_t piece = PieceWith(body, hull);
  const std::string& body_id = body.record().body_id;
  const std::string& hull_id = body.hull_ids()[hull];
  if (!absl::IsNotFound(cause)) {
    return Prefixed(absl::StrCat(Quoted("body", body_id), ": piece ", piece, ": "), cause);
  }
  return WithReason(absl::NotFoundError(absl::StrCat(
                        Quoted("body", body_id), ": piece ", piece, ": ", cause.message(),
                        "; create it, or remove that piece from the body")),
                    v1::ERROR_REASON_PIECE_NOT_FOUND,
                    {{"body_id", body_id}, {"piece", uint64_t{piece}}, {"hull_id", hull_id}});
}

// find_hull: returns the resolved hull of an ID.
template <typename FindHull>
absl::StatusOr<HullView> ServeBody(Registry& registry, const std::shared_ptr<const Body>& body,
                                   const PlacedLookup& lookup, const FindHull& find_hull) {
  if (!body->damage().ok()) return body->damage();
  HULLD_RETURN_IF_ERROR(CheckPiecePrefix(*body, lookup.prefix));
  constexpr size_t kPerHull = sizeof(HullView) + sizeof(const QueryHull*) + 2 * sizeof(uint64_t);
  MemoryCharge charge(
      registry.memory(), MemoryUse::kReading,
      body->pieces().size() * sizeof(BodyPiece) + body->hull_ids().size() * kPerHull);
  HULLD_RETURN_IF_ERROR(registry.CheckMemory(MemoryUse::kReading));
  std::vector<HullView> hulls;
  std::vector<const QueryHull*> query_hulls;
  std::vector<uint64_t> revisions;
  for (size_t k = 0; k < body->hull_ids().size(); ++k) {
    const absl::StatusOr<HullView>& hull = find_hull(body->hull_ids()[k]);
    if (!hull.ok()) return WhyNoPiece(*body, k, hull.status());
    hulls.push_back(*hull);
    query_hulls.push_back(lookup.canonical ? &hull->served->canonical_query_hull()
                                           : &hull->served->query_hull());
    revisions.push_back(hull->record.create_revision);
    revisions.push_back(hull->record.revision);
  }
  std::vector<BodyPiece> pieces;
  pieces.reserve(body->pieces().size());
  for (const StoredPiece& piece : body->pieces()) {
    pieces.push_back({query_hulls[piece.hull], piece.X_BP, piece.radius});
  }
  auto boxes = body->BoxesOf(pieces, std::move(revisions));
  HullRecord record;
  record.hull_id = body->record().body_id;
  record.create_revision = body->record().create_revision;
  record.revision = body->record().revision;
  return HullView{record, nullptr,
                  std::make_shared<const ServedBody>(ServedBody{
                      body, std::move(hulls), QueryBody(std::move(pieces), std::move(boxes)),
                      std::move(charge)})};
}

// Builds canonical snapshots of the resolved hulls, and their query structures. CANCELLED:
// should_stop returned true. WouldWait: some are not built, and may_wait is false.
absl::Status MakeCanonical(Registry& registry, const std::function<bool()>& should_stop,
                           bool may_wait, std::vector<absl::StatusOr<HullView>>& hulls) {
  for (absl::StatusOr<HullView>& hull : hulls) {
    if (!hull.ok() || hull->served->has_canonical_query_hull()) continue;
    if (!may_wait) return WouldWait();
    absl::Status made = registry.reader().Canonical(*hull, should_stop).status();
    if (made.ok()) made = hull->served->MakeCanonicalQueryHull(should_stop);
    if (absl::IsCancelled(made)) return made;
    if (!made.ok()) hull = made;
  }
  return absl::OkStatus();
}

ReadPlan PlanOf(const PlacedLookup& lookup) {
  const ReadPlan& plan = lookup.plan;
  return lookup.canonical ? ReadPlan{.freshness = plan.freshness, .may_wait = plan.may_wait} : plan;
}

// Returns the bodies among the IDs; empty if there are none. Omits IDs that cannot be read now: the
// subsequent hull lookup reports their errors. Other errors: see RecordReader::FindBodies.
// WouldWait also if there are bodies, whose boxes must be built.
absl::StatusOr<Bodies> BodiesAmong(Registry& registry, std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop, bool may_wait) {
  if (!registry.has_bodies()) return Bodies();
  FoundBodies found = registry.records().FindBodies(ids, should_stop, may_wait);
  if (!found.status.ok() && !absl::IsUnavailable(found.status)) return found.status;
  if (std::ranges::all_of(found.bodies, [](const auto& body) { return body == nullptr; })) {
    return Bodies();
  }
  if (!may_wait) return WouldWait();
  return std::move(found.bodies);
}

// A body that was read again is a different object. Damaged bodies compare by identity only.
bool IsSameBody(const std::shared_ptr<const Body>& a, const std::shared_ptr<const Body>& b) {
  if (a == b) return true;
  return a != nullptr && b != nullptr && a->record().revision == b->record().revision &&
         a->damage().code() == b->damage().code();
}

// Bytes built between two checks of --memory-limit. A call that needs less is always answered.
constexpr size_t kUncheckedBytes = 256 << 10;

// The hull of a shape, and its charge.
struct InlineHull {
  ServedHull served;
  MemoryCharge charge;
};

std::shared_ptr<const InlineHull> BuildInlineHull(std::span<const Vector> points,
                                                  MemoryBudget& memory) {
  HullBuilder builder;
  HULLD_CHECK(builder.Add(points).ok());
  const auto canonical = std::make_shared<CanonicalHull>(builder.Snapshot());
  const std::shared_ptr<const QueryHull> version(canonical, &canonical->query_hull());
  Box box = {points.front(), points.front()};
  for (const Vector& vertex : canonical->hull()->vertices()) {
    box = {box.low.cwiseMin(vertex), box.high.cwiseMax(vertex)};
  }
  const size_t bytes = sizeof(InlineHull) + sizeof(CanonicalHull) + canonical->MemoryBytes();
  return std::make_shared<const InlineHull>(InlineHull{
      ServedHull(version, box, canonical), MemoryCharge(memory, MemoryUse::kReading, bytes)});
}

// Builds the hull of each shape, ready for all queries. Its record has no ID and no revision. It is
// charged to the readers' share of --memory-limit while a view references it. CANCELLED:
// should_stop returned true. RESOURCE_EXHAUSTED: readers exceed their share.
absl::StatusOr<std::vector<HullView>> BuildInlineShapes(Registry& registry,
                                                        const InlineShapes& shapes,
                                                        const std::function<bool()>& should_stop) {
  std::vector<HullView> views;
  views.reserve(shapes.size());
  size_t unchecked_bytes = 0;
  for (size_t k = 0; k < shapes.size(); ++k) {
    if (Stopped(should_stop)) return Cancelled();
    if (unchecked_bytes > kUncheckedBytes) {
      HULLD_RETURN_IF_ERROR(registry.CheckMemory(MemoryUse::kReading));
      unchecked_bytes = 0;
    }
    const auto hull = BuildInlineHull(shapes.PointsOf(k), registry.memory());
    unchecked_bytes += hull->charge.bytes();
    views.push_back({{}, std::shared_ptr<const ServedHull>(hull, &hull->served)});
  }
  return views;
}

}  // namespace

bool KnownPlaced::AreBodies(const Bodies& bodies) const {
  return std::ranges::equal(bodies, bodies_, IsSameBody);
}

void KnownPlaced::SetBodies(std::span<const std::string> ids, Bodies bodies) {
  if (AreBodies(bodies)) return;
  bodies_ = std::move(bodies);
  hull_ids_.clear();
  index_of_.clear();
  hulls_ = KnownHulls();
  for (size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i] == nullptr) AddHull(ids[i]);
  }
  for (const auto& body : bodies_) {
    if (body == nullptr) continue;
    for (const std::string& id : body->hull_ids()) AddHull(id);
  }
}

void KnownPlaced::AddHull(const std::string& id) {
  if (index_of_.emplace(id, hull_ids_.size()).second) hull_ids_.push_back(id);
}

size_t KnownPlaced::BodyBytes() const {
  // Two copies of the ID and a map node.
  constexpr size_t kPerHull = 2 * sizeof(std::string) + 4 * sizeof(size_t) + KnownHulls::kBytesEach;
  size_t bytes = bodies_.capacity() * sizeof(bodies_[0]) + hull_ids_.size() * kPerHull;
  for (const std::string& id : hull_ids_) bytes += 2 * id.capacity();
  return bytes;
}

absl::Status CheckPiecePrefix(const Body& body, const std::string& prefix) {
  for (size_t hull = 0; hull < body.hull_ids().size(); ++hull) {
    if (body.hull_ids()[hull].starts_with(prefix)) continue;
    return WithReason(
        absl::PermissionDeniedError(absl::StrCat(
            Quoted("body", body.record().body_id), ": the hull of piece ", PieceWith(body, hull),
            " is outside the token's prefix \"", prefix, "\"; use another token")),
        v1::ERROR_REASON_OUTSIDE_PREFIX, {{"prefix", prefix}});
  }
  return absl::OkStatus();
}

absl::StatusOr<Resolved> ResolvePlaced(Registry& registry, std::span<const std::string> ids,
                                       const PlacedLookup& lookup,
                                       const std::function<bool()>& should_stop) {
  KnownPlaced known(/*for_one_lookup=*/true);
  return known.Resolve(registry, ids, lookup, should_stop);
}

// Looks up the bodies before and after the hulls. If both lookups agree, the bodies were current
// throughout, including at the revision of the hulls.
absl::StatusOr<Resolved> KnownPlaced::Resolve(Registry& registry, std::span<const std::string> ids,
                                              const PlacedLookup& lookup,
                                              const std::function<bool()>& should_stop) {
  const bool may_wait = lookup.plan.may_wait;
  if (lookup.shapes != nullptr && !lookup.shapes->empty() && shapes_.empty()) {
    if (!may_wait) return WouldWait();
    HULLD_ASSIGN_OR_RETURN(shapes_, BuildInlineShapes(registry, *lookup.shapes, should_stop));
  }
  absl::StatusOr<Bodies> bodies = BodiesAmong(registry, ids, should_stop, may_wait);
  absl::StatusOr<Resolved> hulls;
  do {
    if (!bodies.ok()) return bodies.status();
    SetBodies(ids, *std::move(bodies));
    hulls = registry.reader().Refresh(has_bodies() ? std::span<const std::string>(hull_ids_) : ids,
                                      hulls_, should_stop, PlanOf(lookup));
    if (!hulls.ok()) return hulls;
    bodies = BodiesAmong(registry, ids, should_stop, may_wait);
  } while (!bodies.ok() || !AreBodies(*bodies));
  // The resolved snapshots are immutable, so building may take long.
  if (lookup.canonical) {
    HULLD_RETURN_IF_ERROR(MakeCanonical(registry, should_stop, may_wait, hulls->hulls));
  }
  if (has_bodies()) {
    const auto find_hull = [&](const std::string& id) -> const absl::StatusOr<HullView>& {
      return hulls->hulls[index_of_.at(id)];
    };
    std::vector<absl::StatusOr<HullView>> placed;
    placed.reserve(ids.size());
    for (size_t i = 0; i < ids.size(); ++i) {
      placed.push_back(bodies_[i] == nullptr ? find_hull(ids[i])
                                             : ServeBody(registry, bodies_[i], lookup, find_hull));
    }
    hulls->hulls = std::move(placed);
  }
  hulls->hulls.insert(hulls->hulls.end(), shapes_.begin(), shapes_.end());
  return hulls;
}

}  // namespace hulld::server
