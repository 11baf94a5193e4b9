#include "server/registry/bodies/body_resolution.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <unordered_map>
#include <utility>

#include "server/contract/error_info.h"
#include "server/contract/status_map.h"

namespace hulld::server {
namespace {

using Bodies = std::vector<std::shared_ptr<const Body>>;

// The hulls to look up for some IDs: those that are none of bodies, then those of pieces. Each
// once.
class HullList {
 public:
  HullList(std::span<const std::string> ids, const Bodies& bodies) {
    for (size_t i = 0; i < ids.size(); ++i) {
      if (bodies[i] == nullptr) Add(ids[i]);
    }
    for (const auto& body : bodies) {
      if (body == nullptr) continue;
      for (const std::string& id : body->hull_ids()) Add(id);
    }
  }

  const std::vector<std::string>& ids() const { return ids_; }
  size_t IndexOf(const std::string& id) const { return index_of_.at(id); }

 private:
  void Add(const std::string& id) {
    if (index_of_.emplace(id, ids_.size()).second) ids_.push_back(id);
  }

  std::vector<std::string> ids_;
  std::unordered_map<std::string, size_t> index_of_;
};

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

absl::StatusOr<HullView> ServeBody(Registry& registry, const std::shared_ptr<const Body>& body,
                                   const PlacedLookup& lookup, const HullList& list,
                                   const std::vector<absl::StatusOr<HullView>>& found) {
  if (!body->damage().ok()) return body->damage();
  if (absl::Status s = CheckPiecePrefix(*body, lookup.prefix); !s.ok()) return s;
  constexpr size_t kPerHull = sizeof(HullView) + sizeof(const QueryHull*) + 2 * sizeof(uint64_t);
  MemoryCharge charge(registry.memory(), body->pieces().size() * sizeof(BodyPiece) +
                                             body->hull_ids().size() * kPerHull);
  if (absl::Status s = registry.CheckMemory(); !s.ok()) return s;
  std::vector<HullView> hulls;
  std::vector<const QueryHull*> query_hulls;
  std::vector<uint64_t> revisions;
  for (size_t k = 0; k < body->hull_ids().size(); ++k) {
    const absl::StatusOr<HullView>& hull = found[list.IndexOf(body->hull_ids()[k])];
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
absl::Status MakeCanonical(Registry& registry, const std::function<bool()>& should_stop,
                           std::vector<absl::StatusOr<HullView>>& hulls) {
  for (absl::StatusOr<HullView>& hull : hulls) {
    if (!hull.ok()) continue;
    const absl::Status made = registry.Canonical(*hull, should_stop).status();
    if (absl::IsCancelled(made)) return made;
    if (!made.ok()) hull = made;
  }
  return absl::OkStatus();
}

absl::StatusOr<Resolved> ResolveHulls(Registry& registry, std::span<const std::string> ids,
                                      const PlacedLookup& lookup,
                                      const std::function<bool()>& should_stop) {
  absl::StatusOr<Resolved> resolved =
      registry.Resolve(ids, should_stop, lookup.canonical ? ReadPlan() : lookup.plan);
  if (!resolved.ok() || !lookup.canonical) return resolved;
  if (absl::Status s = MakeCanonical(registry, should_stop, resolved->hulls); !s.ok()) return s;
  return resolved;
}

bool HasAny(const Bodies& bodies) {
  for (const auto& body : bodies) {
    if (body != nullptr) return true;
  }
  return false;
}

}  // namespace

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

// Bodies are looked for before and after the hulls. Where they are the same, they were current all
// the while, so at the revision at which the hulls were, too.
absl::StatusOr<Resolved> ResolvePlaced(Registry& registry, std::span<const std::string> ids,
                                       const PlacedLookup& lookup,
                                       const std::function<bool()>& should_stop) {
  if (!lookup.takes_bodies || !registry.has_bodies()) {
    return ResolveHulls(registry, ids, lookup, should_stop);
  }
  Bodies bodies = registry.FindBodies(ids).bodies;
  while (true) {
    const HullList list(ids, bodies);
    absl::StatusOr<Resolved> hulls = ResolveHulls(registry, list.ids(), lookup, should_stop);
    if (!hulls.ok()) return hulls.status();
    Bodies now = registry.FindBodies(ids).bodies;
    if (now != bodies) {
      bodies = std::move(now);
      continue;
    }
    Resolved resolved;
    resolved.store_revision = hulls->store_revision;
    resolved.hulls.reserve(ids.size());
    for (size_t i = 0; i < ids.size(); ++i) {
      if (bodies[i] == nullptr) {
        resolved.hulls.push_back(hulls->hulls[list.IndexOf(ids[i])]);
      } else {
        resolved.hulls.push_back(ServeBody(registry, bodies[i], lookup, list, hulls->hulls));
      }
    }
    return resolved;
  }
}

std::optional<Resolved> TryResolvePlaced(Registry& registry, std::span<const std::string> ids,
                                         const PlacedLookup& lookup) {
  const bool may_be_bodies = lookup.takes_bodies && registry.has_bodies();
  if (may_be_bodies && HasAny(registry.FindBodies(ids).bodies)) return std::nullopt;
  std::optional<Resolved> resolved =
      registry.TryResolve(ids, lookup.canonical ? ReadPlan() : lookup.plan);
  if (!resolved.has_value() || !lookup.canonical) return resolved;
  for (const absl::StatusOr<HullView>& hull : resolved->hulls) {
    if (hull.ok() && !hull->served->has_canonical_query_hull()) return std::nullopt;
  }
  return resolved;
}

}  // namespace hulld::server
