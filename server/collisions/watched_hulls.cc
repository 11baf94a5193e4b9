#include "server/collisions/watched_hulls.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/registry/catalog/body.h"

namespace hulld::server {
namespace {

// Bytes of a piece's hull: its ID twice and the nodes of a map and a set; a guess.
size_t BytesOf(const std::string& id) { return 2 * id.size() + 256; }

// Calls `visit` with the record of each hull and body in use, except those of inline shapes.
template <typename Visit>
void ForEachRecord(const Resolved& resolved, const Visit& visit) {
  for (const absl::StatusOr<HullView>& view : resolved.hulls) {
    if (!view.ok() || view->record.hull_id.empty()) continue;
    visit(view->record);
    if (view->body == nullptr) continue;
    for (const HullView& piece : view->body->hulls) visit(piece.record);
  }
}

}  // namespace

// Starts the watch before resolving, so that it misses no change. A change in between is resolved
// twice.
absl::StatusOr<WatchedHulls::Round> WatchedHulls::Open(std::span<const std::string> ids,
                                                       std::function<void()> on_ready,
                                                       const PlacedLookup& lookup,
                                                       const std::function<bool()>& should_stop) {
  HULLD_CHECK(watch_ == nullptr);
  ids_.assign(ids.begin(), ids.end());
  pieces_.resize(ids_.size());
  lookup_ = lookup;
  WatchTarget target;
  target.bodies = true;
  target.lists_existing = false;
  std::set<size_t> all;
  for (size_t place = 0; place < ids_.size(); ++place) {
    target.ids.insert(ids_[place]);
    hulls_[ids_[place]].places.insert(place);
    all.insert(all.end(), place);
  }
  // No hull has the empty ID, so without placements the watch waits until the server drains.
  if (target.ids.empty()) target.ids.emplace();
  HULLD_ASSIGN_OR_RETURN(watch_, registry_.feed().Open(target, {}, std::move(on_ready)));
  Round round;
  HULLD_RETURN_IF_ERROR(Resolve(std::move(all), should_stop, &round));
  // Changes are applied here before the watch reports them. Inline shapes do not change.
  lookup_.plan = {.freshness = Freshness::AnyStaleness()};
  lookup_.shapes = nullptr;
  round.revision = revision_ = round.resolved.as_of.revision;
  return round;
}

absl::StatusOr<WatchedHulls::Round> WatchedHulls::TakeChanges(
    const std::function<bool()>& should_stop) {
  HULLD_ASSIGN_OR_RETURN(const WatchBatch batch, registry_.feed().Next(watch_));
  Round round;
  round.waits = batch.waits;
  if (round.waits) return round;
  round.has_advanced = batch.revision > revision_;
  round.revision = revision_ = std::max(revision_, batch.revision);
  std::set<size_t> places = PlacesOf(batch);
  if (places.empty()) return round;
  HULLD_RETURN_IF_ERROR(Resolve(std::move(places), should_stop, &round));
  return round;
}

void WatchedHulls::Close() {
  if (watch_ != nullptr) registry_.feed().Close(std::exchange(watch_, nullptr));
}

// Returns the places affected by the changes; all places if the changes are unknown.
std::set<size_t> WatchedHulls::PlacesOf(const WatchBatch& batch) const {
  std::set<size_t> places;
  for (size_t place = 0; batch.restarted && place < ids_.size(); ++place) {
    places.insert(places.end(), place);
  }
  for (const HullChange& change : batch.changes) {
    const auto hull = hulls_.find(change.record.hull_id);
    if (hull != hulls_.end()) places.insert(hull->second.places.begin(), hull->second.places.end());
  }
  return places;
}

// Resolves all places that use a changed hull at one revision. If a resolved hull is newer than the
// version that another place uses, adds that place and repeats. Also repeats if a body changed
// concurrently and its new pieces are not watched yet.
absl::Status WatchedHulls::Resolve(std::set<size_t> places,
                                   const std::function<bool()>& should_stop, Round* round) {
  while (true) {
    round->places.assign(places.begin(), places.end());
    std::vector<std::string> ids;
    ids.reserve(places.size());
    for (const size_t place : places) ids.push_back(ids_[place]);
    HULLD_RETURN_IF_ERROR(WatchPieces(round->places, ids, should_stop));
    HULLD_ASSIGN_OR_RETURN(Resolved resolved, ResolvePlaced(registry_, ids, lookup_, should_stop));
    round->resolved = std::move(resolved);
    AddOutdatedPlaces(round->resolved, &places);
    if (places.size() == round->places.size() && HasWatchedPieces(*round)) break;
  }
  UseVersions(round);
  return absl::OkStatus();
}

// Watches the hulls of the pieces of these places' bodies, including bodies that cannot be resolved
// because a hull is missing.
absl::Status WatchedHulls::WatchPieces(std::span<const size_t> places,
                                       std::span<const std::string> ids,
                                       const std::function<bool()>& should_stop) {
  std::vector<std::vector<std::string>> hull_ids(places.size());
  if (registry_.has_bodies()) {
    const FoundBodies found = registry_.records().FindBodies(ids, should_stop);
    if (!found.status.ok()) return found.status;
    for (size_t n = 0; n < places.size(); ++n) {
      const Body* const body = found.bodies[n].get();
      if (body == nullptr || !CheckPiecePrefix(*body, lookup_.prefix).ok()) continue;
      hull_ids[n].assign(body->hull_ids().begin(), body->hull_ids().end());
    }
  }
  SetPieces(places, std::move(hull_ids));
  return absl::OkStatus();
}

// Adds all new pieces before it removes any, so that a hull that moves from one body to another
// remains watched.
void WatchedHulls::SetPieces(std::span<const size_t> places,
                             std::vector<std::vector<std::string>> hull_ids) {
  std::vector<std::string> added;
  std::vector<std::string> removed;
  for (size_t n = 0; n < places.size(); ++n) {
    if (hull_ids[n] == pieces_[places[n]]) continue;
    for (const std::string& id : hull_ids[n]) {
      const auto [hull, is_new] = hulls_.try_emplace(id);
      if (is_new) added.push_back(id);
      hull->second.places.insert(places[n]);
      piece_bytes_ += BytesOf(id);
    }
  }
  for (size_t n = 0; n < places.size(); ++n) {
    const size_t place = places[n];
    if (hull_ids[n] == pieces_[place]) continue;
    std::swap(hull_ids[n], pieces_[place]);
    const std::set<std::string_view> current(pieces_[place].begin(), pieces_[place].end());
    for (const std::string& id : hull_ids[n]) {
      piece_bytes_ -= BytesOf(id);
      if (current.contains(id) || id == ids_[place]) continue;
      const auto hull = hulls_.find(id);
      HULLD_CHECK(hull != hulls_.end());
      hull->second.places.erase(place);
      if (!hull->second.places.empty()) continue;
      removed.push_back(id);
      hulls_.erase(hull);
    }
  }
  if (!added.empty() || !removed.empty()) registry_.feed().ChangeIds(*watch_, added, removed);
}

// Returns false if a body was put after its pieces were looked up.
bool WatchedHulls::HasWatchedPieces(const Round& round) const {
  for (size_t n = 0; n < round.places.size(); ++n) {
    const absl::StatusOr<HullView>& view = round.resolved.hulls[n];
    if (!view.ok() || view->body == nullptr) continue;
    if (!std::ranges::equal(view->body->body->hull_ids(), pieces_[round.places[n]])) return false;
  }
  return true;
}

void WatchedHulls::AddOutdatedPlaces(const Resolved& resolved, std::set<size_t>* places) const {
  ForEachRecord(resolved, [&](const HullRecord& record) {
    const auto hull = hulls_.find(record.hull_id);
    if (hull == hulls_.end() || hull->second.used == VersionOf(record)) return;
    places->insert(hull->second.places.begin(), hull->second.places.end());
  });
}

void WatchedHulls::UseVersions(Round* round) {
  ForEachRecord(round->resolved, [this](const HullRecord& record) {
    hulls_.at(record.hull_id).used = VersionOf(record);
  });
  for (const absl::StatusOr<HullView>& view : round->resolved.hulls) {
    if (!view.ok() || view->body == nullptr) continue;
    for (const HullView& piece : view->body->hulls) {
      Version& sent = hulls_.at(piece.record.hull_id).sent_as_piece;
      if (sent == VersionOf(piece.record)) continue;
      sent = VersionOf(piece.record);
      round->piece_hulls.push_back(piece.record);
    }
  }
}

}  // namespace hulld::server
