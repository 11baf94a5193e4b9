#include "tests/fuzz/service/watch_check.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "tests/fuzz/service/reply_check.h"

namespace hulld::fuzz {
namespace {

// Returns the kind of event for a transition, as specified by the contract.
v1::CollisionEventKind KindOf(v1::Relation before, bool was_near, v1::Relation after,
                              bool is_near) {
  if (after == v1::RELATION_UNSPECIFIED) return v1::COLLISION_EVENT_KIND_LOST;
  if (after == v1::RELATION_OVERLAPPING && before != after) {
    return v1::COLLISION_EVENT_KIND_ENTER;
  }
  if (after == v1::RELATION_TOUCHING && before != after) return v1::COLLISION_EVENT_KIND_TOUCH;
  if (after != v1::RELATION_SEPARATED) return v1::COLLISION_EVENT_KIND_UNSPECIFIED;
  if (IsCollision(before)) return v1::COLLISION_EVENT_KIND_EXIT;
  if (is_near == was_near) return v1::COLLISION_EVENT_KIND_UNSPECIFIED;
  return is_near ? v1::COLLISION_EVENT_KIND_NEAR : v1::COLLISION_EVENT_KIND_FAR;
}

bool IsThere(const v1::HullEvent& event) {
  return event.kind() != v1::HULL_EVENT_KIND_DELETED && !event.hull().damaged();
}

}  // namespace

bool Resumes(const v1::WatchHullsRequest& request) { return request.after_revision() > 0; }

bool HullWatchCheck::Watches(const std::string& hull_id) const {
  if (!request_.hull_id().empty()) return hull_id == request_.hull_id();
  return absl::StartsWith(hull_id, request_.prefix());
}

std::string HullWatchCheck::Received(const v1::WatchHullsResponse& response) {
  if (response.restarted()) {
    if (!Resumes(request_)) return "a watch from the start restarts";
    hulls_.clear();
    bodies_.clear();
    is_synced_ = false;
    is_restarted_ = true;
  } else if (response.header().revision() < header_.revision()) {
    return "the revision of a watch decreases";
  }
  if (response.synced() && is_synced_) return "a watch reports `synced` twice";
  header_ = response.header();
  std::string last_id;
  uint64_t last_revision = 0;
  std::set<std::string> ids;
  for (const v1::HullEvent& event : response.events()) {
    const v1::HullInfo& hull = event.hull();
    if (!ids.insert(hull.hull_id()).second) return "a hull has two events in one message";
    // Deleted hulls come first, then existing ones.
    const bool is_there = !is_synced_ && event.kind() != v1::HULL_EVENT_KIND_DELETED;
    if (is_there && hull.hull_id() <= last_id) return "events are not in the order of IDs";
    if (!is_there && (hull.revision() < last_revision || !last_id.empty())) {
      return "events are not in the order of revisions";
    }
    if (is_there) last_id = hull.hull_id();
    if (!is_there) last_revision = hull.revision();
    if (event.is_body() && !request_.bodies()) return "a body is reported without a request";
    if (event.is_body() != (event.piece_count() > 0) && IsThere(event)) {
      return "a body without pieces, or a hull with pieces";
    }
    if (event.is_body()) {
      // The ID is no longer a hull's.
      hulls_.erase(hull.hull_id());
      if (IsThere(event)) bodies_.insert(hull.hull_id());
      if (!IsThere(event)) bodies_.erase(hull.hull_id());
      continue;
    }
    if (std::string finding = TakeEvent(event); !finding.empty()) {
      return absl::StrCat("watched hull ", hull.hull_id(), ": ", finding);
    }
  }
  is_synced_ = is_synced_ || response.synced();
  return {};
}

std::string HullWatchCheck::TakeEvent(const v1::HullEvent& event) {
  const v1::HullInfo& hull = event.hull();
  if (!Watches(hull.hull_id())) return "it is not watched";
  const bool is_resumed = Resumes(request_) && !is_restarted_;
  const bool was_body = bodies_.erase(hull.hull_id()) > 0;
  const bool was_known = was_body || hulls_.count(hull.hull_id()) > 0;
  if (event.kind() == v1::HULL_EVENT_KIND_DELETED) {
    if (!is_resumed && !was_known) return "it is reported as deleted, but never existed";
    hulls_.erase(hull.hull_id());
    return {};
  }
  if (is_synced_ == (event.kind() == v1::HULL_EVENT_KIND_PRESENT)) {
    return absl::StrCat("the event has the wrong kind ", v1::HullEventKind_Name(event.kind()));
  }
  if (event.kind() == v1::HULL_EVENT_KIND_CREATED && was_known)
    return "it is reported as created twice";
  const bool changes =
      event.kind() == v1::HULL_EVENT_KIND_CHANGED || event.kind() == v1::HULL_EVENT_KIND_REPLACED;
  if (changes && !is_resumed && !was_known) return "it changes, but was never reported";
  hulls_[hull.hull_id()] = hull;
  if (event.has_box_min() != (hull.vertex_count() > 0) ||
      event.has_box_max() != event.has_box_min()) {
    return "it has a box without vertices, or vertices without a box";
  }
  return CheckHullInfo(hull);
}

CollisionWatchCheck::CollisionWatchCheck(v1::CollisionWatchOpen open) : open_(std::move(open)) {
  for (int i = 0; i + 1 < open_.pairs_size(); i += 2) {
    ++named_[{open_.pairs(i), open_.pairs(i + 1)}];
  }
}

void CollisionWatchCheck::Sent(const v1::CollisionWatchUpdate& update) {
  ++sent_;
  MovePlacements(update, open_.mutable_placements());
}

bool CollisionWatchCheck::IsWatched(const Pair& pair) const {
  if (!named_.empty()) return named_.count(pair) > 0;
  return pair.first < pair.second && pair.second < static_cast<uint32_t>(open_.placements_size()) &&
         Selects(open_, static_cast<int>(pair.first), static_cast<int>(pair.second));
}

std::string CollisionWatchCheck::Received(const v1::WatchCollisionsResponse& response) {
  if (response.update() < reported_update_ || response.update() > sent_) {
    return absl::StrCat("update ", response.update(), " is reported after ", reported_update_,
                        "; updates sent: ", sent_);
  }
  if (response.header().revision() < revision_) return "the revision of a watch decreases";
  revision_ = response.header().revision();
  reported_update_ = response.update();
  for (const auto* const hulls : {&response.hulls(), &response.piece_hulls()}) {
    for (const v1::HullVersion& hull : *hulls) {
      if (hull.revision() == 0) return "a hull has no revision";
      versions_[hull.hull_id()] = {hull.create_revision(), hull.revision()};
    }
  }
  for (const v1::PlacementProblem& problem : response.placement_problems()) {
    if (problem.placement() >= static_cast<uint32_t>(open_.placements_size())) {
      return "a problem is not about a placement";
    }
  }
  for (const v1::CollisionEvent& event : response.events()) {
    if (std::string finding = TakeEvent(event); !finding.empty()) {
      return absl::StrCat("pair ", event.placement_a(), " ", event.placement_b(), ": ", finding);
    }
  }
  is_synced_ = response.synced();
  if (is_synced_) reported_now_.clear();
  return {};
}

// An event is exact at versions that it or an earlier message states.
std::string CollisionWatchCheck::CheckSent(uint32_t placement, uint64_t revision, bool has_piece,
                                           const v1::DecidingPiece& piece) const {
  if (open_.placements(static_cast<int>(placement)).has_points()) return {};
  const std::string& id = open_.placements(static_cast<int>(placement)).hull_id();
  const auto sent = versions_.find(id);
  if (sent == versions_.end() || sent->second.second != revision) {
    return absl::StrCat("revision ", revision, " of ", id, " was not sent");
  }
  if (!has_piece) return {};
  const v1::HullVersion& hull = piece.hull();
  const auto of_piece = versions_.find(hull.hull_id());
  if (of_piece != versions_.end() &&
      of_piece->second == Version(hull.create_revision(), hull.revision())) {
    return {};
  }
  return absl::StrCat("revision ", hull.revision(), " of the piece's hull ", hull.hull_id(),
                      " was not sent");
}

std::string CollisionWatchCheck::TakeEvent(const v1::CollisionEvent& event) {
  const Pair pair = {event.placement_a(), event.placement_b()};
  if (!IsWatched(pair)) return "it is not watched";
  const bool is_lost = event.kind() == v1::COLLISION_EVENT_KIND_LOST;
  // An inline shape has no revision.
  const auto has_revision = [&](uint32_t placement) {
    return !is_lost && !open_.placements(static_cast<int>(placement)).has_points();
  };
  if (has_revision(event.placement_a()) != (event.revision_a() != 0) ||
      has_revision(event.placement_b()) != (event.revision_b() != 0)) {
    return "an event has revisions without an answer, or an answer without revisions";
  }
  if (event.has_within_clearance() != (open_.has_clearance() && !is_lost)) {
    return "the clearance is reported without a request, or is missing";
  }
  if (!is_lost) {
    std::string finding =
        CheckSent(pair.first, event.revision_a(), event.has_piece_a(), event.piece_a());
    if (finding.empty()) {
      finding = CheckSent(pair.second, event.revision_b(), event.has_piece_b(), event.piece_b());
    }
    if (!finding.empty()) return finding;
  }
  State& state = reported_[pair];
  const State before = state;
  state = {event.relation(), event.within_clearance()};
  // A pair named twice is reported twice.
  const auto named = named_.find(pair);
  if (named != named_.end() && named->second > 1) return {};
  if (!reported_now_.insert(pair).second) return "it is reported twice";
  const v1::CollisionEventKind kind =
      KindOf(before.relation, before.is_near, state.relation, state.is_near);
  if (event.kind() == kind) return {};
  return absl::StrCat("the event is ", v1::CollisionEventKind_Name(event.kind()), " from ",
                      v1::Relation_Name(before.relation), " to ",
                      v1::Relation_Name(state.relation));
}

std::map<std::pair<uint32_t, uint32_t>, v1::Relation> CollisionWatchCheck::Colliding() const {
  std::map<Pair, v1::Relation> colliding;
  for (const auto& [pair, state] : reported_) {
    if (!IsCollision(state.relation)) continue;
    colliding[std::minmax(pair.first, pair.second)] = state.relation;
  }
  return colliding;
}

v1::BatchCheckCollisionsRequest CollisionWatchCheck::AsBatch() const {
  v1::BatchCheckCollisionsRequest request;
  *request.mutable_placements() = open_.placements();
  if (!named_.empty()) {
    *request.mutable_pairs() = open_.pairs();
    return request;
  }
  for (uint32_t b = 0; b < static_cast<uint32_t>(open_.placements_size()); ++b) {
    for (uint32_t a = 0; a < b; ++a) {
      if (!IsWatched({a, b})) continue;
      request.add_pairs(a);
      request.add_pairs(b);
    }
  }
  return request;
}

}  // namespace hulld::fuzz
