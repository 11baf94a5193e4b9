#include "server/shards/body_resolution.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/status_map.h"

namespace hulld::server {
namespace {

using Bodies = std::vector<std::shared_ptr<const Body>>;

// The first piece that has this hull.
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
    return Prefixed(absl::StrCat(QuotedBody(body_id), ": piece ", piece, ": "), cause);
  }
  return WithReason(
      absl::NotFoundError(absl::StrCat(QuotedBody(body_id), ": piece ", piece, ": ",
                                       cause.message(), "; create it, or put the body without it")),
      v1::ERROR_REASON_PIECE_NOT_FOUND,
      {{"body_id", body_id}, {"piece", uint64_t{piece}}, {"hull_id", hull_id}});
}

// What was resolved of a hull, by ID.
using FindHull = std::function<const absl::StatusOr<HullView>&(const std::string&)>;

absl::StatusOr<HullView> ServeBody(Shards& shards, const std::shared_ptr<const Body>& body,
                                   const PlacedLookup& lookup, const FindHull& find_hull) {
  if (!body->damage().ok()) return body->damage();
  if (absl::Status s = CheckPiecePrefix(*body, lookup.prefix); !s.ok()) return s;
  constexpr size_t kPerHull = sizeof(HullView) + sizeof(const QueryHull*) + 2 * sizeof(uint64_t);
  MemoryCharge charge(
      shards.memory(), MemoryUse::kReading,
      body->pieces().size() * sizeof(BodyPiece) + body->hull_ids().size() * kPerHull);
  if (absl::Status s = shards.CheckMemory(MemoryUse::kReading); !s.ok()) return s;
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
    pieces.push_back({query_hulls[piece.hull], piece.X_BP});
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

// Canonical snapshots of what was found. CANCELLED: should_stop said so.
absl::Status MakeCanonical(Shards& shards, const std::function<bool()>& should_stop,
                           std::vector<absl::StatusOr<HullView>>& hulls) {
  for (absl::StatusOr<HullView>& hull : hulls) {
    if (!hull.ok()) continue;
    const absl::Status made = shards.Canonical(*hull, should_stop).status();
    if (absl::IsCancelled(made)) return made;
    if (!made.ok()) hull = made;
  }
  return absl::OkStatus();
}

ShardsPlan PlanOf(const PlacedLookup& lookup) {
  return lookup.canonical ? ShardsPlan{.freshness = lookup.plan.freshness} : lookup.plan;
}

// The bodies among the IDs; empty where there are none. What cannot be read now is not among them:
// a caller that looks for a hull under the ID is told why. CANCELLED, RESOURCE_EXHAUSTED: as
// FindBodies.
absl::StatusOr<Bodies> BodiesAmong(Shards& shards, std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop) {
  if (!shards.has_bodies()) return Bodies();
  FoundBodies found = shards.FindBodies(ids, should_stop);
  if (!found.status.ok() && !absl::IsUnavailable(found.status)) return found.status;
  if (std::ranges::all_of(found.bodies, [](const auto& body) { return body == nullptr; })) {
    return Bodies();
  }
  return std::move(found.bodies);
}

// A body that was read again is another object. No more is known of bodies that are damaged.
bool IsSameBody(const std::shared_ptr<const Body>& a, const std::shared_ptr<const Body>& b) {
  if (a == b) return true;
  return a != nullptr && b != nullptr && a->record().revision == b->record().revision &&
         a->damage().code() == b->damage().code();
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
  hulls_ = {};
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
  // An ID twice, and a node of the map.
  constexpr size_t kPerHull =
      2 * sizeof(std::string) + 4 * sizeof(size_t) + KnownInShards::kBytesEach;
  size_t bytes = bodies_.capacity() * sizeof(bodies_[0]) + hull_ids_.size() * kPerHull;
  for (const std::string& id : hull_ids_) bytes += 2 * id.capacity();
  return bytes;
}

absl::Status CheckPiecePrefix(const Body& body, const std::string& prefix) {
  for (size_t hull = 0; hull < body.hull_ids().size(); ++hull) {
    if (body.hull_ids()[hull].starts_with(prefix)) continue;
    return WithReason(
        absl::PermissionDeniedError(absl::StrCat(
            QuotedBody(body.record().body_id), ": the hull of piece ", PieceWith(body, hull),
            " is outside of \"", prefix, "\", which the token is limited to; use another token")),
        v1::ERROR_REASON_OUTSIDE_PREFIX, {{"prefix", prefix}});
  }
  return absl::OkStatus();
}

absl::StatusOr<ShardsResolved> ResolvePlaced(Shards& shards, std::span<const std::string> ids,
                                             const PlacedLookup& lookup,
                                             const std::function<bool()>& should_stop) {
  KnownPlaced known;
  return RefreshPlaced(shards, ids, known, lookup, should_stop);
}

// Bodies are looked for before and after the hulls. Where they are the same, they were current all
// the while, so at the revision at which the hulls were, too.
absl::StatusOr<ShardsResolved> RefreshPlaced(Shards& shards, std::span<const std::string> ids,
                                             KnownPlaced& known, const PlacedLookup& lookup,
                                             const std::function<bool()>& should_stop) {
  absl::StatusOr<Bodies> bodies = BodiesAmong(shards, ids, should_stop);
  absl::StatusOr<ShardsResolved> hulls;
  bool have_changed = true;
  while (have_changed) {
    if (!bodies.ok()) return bodies.status();
    have_changed = false;
    known.SetBodies(ids, std::exchange(*bodies, {}));
    const auto holds = [&] {
      bodies = BodiesAmong(shards, ids, should_stop);
      have_changed = !bodies.ok() || !known.AreBodies(*bodies);
      return !have_changed;
    };
    // The shards of the bodies belong to the call, too.
    const bool has_bodies = known.has_bodies();
    hulls = shards.Refresh(has_bodies ? std::span<const std::string>(known.hull_ids_) : ids,
                           known.hulls_, should_stop, PlanOf(lookup),
                           has_bodies ? ids : std::span<const std::string>(), holds);
  }
  if (!hulls.ok()) return hulls;
  // What was found stays what it was, however long that takes.
  if (lookup.canonical) {
    if (absl::Status s = MakeCanonical(shards, should_stop, hulls->hulls); !s.ok()) return s;
  }
  if (!known.has_bodies()) return hulls;
  const FindHull find_hull = [&](const std::string& id) -> const absl::StatusOr<HullView>& {
    return hulls->hulls[known.index_of_.at(id)];
  };
  ShardsResolved resolved;
  resolved.as_of = hulls->as_of;
  resolved.hulls.reserve(ids.size());
  for (size_t i = 0; i < ids.size(); ++i) {
    resolved.hulls.push_back(known.bodies_[i] == nullptr
                                 ? find_hull(ids[i])
                                 : ServeBody(shards, known.bodies_[i], lookup, find_hull));
  }
  return resolved;
}

std::optional<ShardsResolved> TryResolvePlaced(Shards& shards, std::span<const std::string> ids,
                                               const PlacedLookup& lookup) {
  if (shards.has_bodies()) {
    const std::optional<FoundBodies> found = shards.TryFindBodies(ids);
    if (!found.has_value()) return std::nullopt;
    const auto is_none = [](const auto& body) { return body == nullptr; };
    if (!std::ranges::all_of(found->bodies, is_none)) return std::nullopt;
  }
  std::optional<ShardsResolved> resolved = shards.TryResolve(ids, PlanOf(lookup));
  if (!resolved.has_value()) return resolved;
  for (const absl::StatusOr<HullView>& hull : resolved->hulls) {
    // It may be a body since they were looked for.
    if (absl::IsNotFound(hull.status()) && shards.has_bodies()) return std::nullopt;
    if (!lookup.canonical || !hull.ok()) continue;
    if (!hull->served->has_canonical_query_hull()) return std::nullopt;
  }
  return resolved;
}

}  // namespace hulld::server
