#include "client/watch/reported_pairs.h"

namespace hulld {
namespace {

bool IsCollision(v1::Relation relation) {
  return relation == v1::RELATION_OVERLAPPING || relation == v1::RELATION_TOUCHING;
}

}  // namespace

ReportedPairs::ReportedPairs(const v1::CollisionWatchOpen& open) {
  for (const v1::Placement& placement : open.placements()) {
    open_.add_placements()->set_hull_id(placement.hull_id());
  }
  *open_.mutable_packed_placements()->mutable_hull_ids() = open.packed_placements().hull_ids();
  *open_.mutable_packed_placements()->mutable_hulls() = open.packed_placements().hulls();
  if (open.has_clearance()) open_.set_clearance(open.clearance());
}

void ReportedPairs::Restart() { reported_again_.emplace(); }

void ReportedPairs::Take(v1::WatchCollisionsResponse* message) {
  TakeHulls(*message);
  TakeProblems(message);
  TakeEvents(message);
  if (!reported_again_ || !message->synced()) return;
  ReportEnded(message);
  reported_again_.reset();
}

const std::string& ReportedPairs::HullOf(uint32_t placement) const {
  const v1::PackedPlacements& packed = open_.packed_placements();
  const size_t i = placement;
  if (i < static_cast<size_t>(open_.placements_size())) {
    return open_.placements(static_cast<int>(i)).hull_id();
  }
  if (i < static_cast<size_t>(packed.hulls_size())) {
    const size_t hull = packed.hulls(static_cast<int>(i));
    if (hull < static_cast<size_t>(packed.hull_ids_size())) {
      return packed.hull_ids(static_cast<int>(hull));
    }
  }
  static const std::string kNone;
  return kNone;
}

void ReportedPairs::TakeHulls(const v1::WatchCollisionsResponse& message) {
  for (const v1::HullVersion& hull : message.hulls()) {
    revisions_[hull.hull_id()] = hull.revision();
    std::erase_if(problems_,
                  [&](const auto& problem) { return HullOf(problem.first) == hull.hull_id(); });
  }
}

void ReportedPairs::TakeProblems(v1::WatchCollisionsResponse* message) {
  v1::WatchCollisionsResponse kept;
  for (const v1::PlacementProblem& problem : message->placement_problems()) {
    std::string& known = problems_[problem.placement()];
    if (reported_again_ && known == problem.message()) continue;
    known = problem.message();
    *kept.add_placement_problems() = problem;
  }
  message->mutable_placement_problems()->Swap(kept.mutable_placement_problems());
}

void ReportedPairs::TakeEvents(v1::WatchCollisionsResponse* message) {
  v1::WatchCollisionsResponse kept;
  for (v1::CollisionEvent& event : *message->mutable_events()) {
    if (TakeEvent(&event)) *kept.add_events() = std::move(event);
  }
  message->mutable_events()->Swap(kept.mutable_events());
}

bool ReportedPairs::TakeEvent(v1::CollisionEvent* event) {
  const Pair pair(event->placement_a(), event->placement_b());
  const State now = {event->relation(), event->within_clearance()};
  State before;
  if (const auto known = reported_.find(pair); known != reported_.end()) before = known->second;
  if (IsCollision(now.relation) || now.within_clearance) {
    reported_[pair] = now;
  } else {
    reported_.erase(pair);
  }
  if (!reported_again_) return true;
  reported_again_->insert(pair);
  // The new call has no previous state to compare with.
  if (now.relation == v1::RELATION_SEPARATED && IsCollision(before.relation)) {
    event->set_kind(v1::COLLISION_EVENT_KIND_EXIT);
  }
  return now.relation != before.relation || now.within_clearance != before.within_clearance;
}

void ReportedPairs::ReportEnded(v1::WatchCollisionsResponse* message) {
  std::erase_if(reported_, [&](const auto& known) {
    if (reported_again_->contains(known.first)) return false;
    *message->add_events() = EndOf(known.first, known.second);
    return true;
  });
}

v1::CollisionEvent ReportedPairs::EndOf(const Pair& pair, const State& before) const {
  v1::CollisionEvent event;
  event.set_placement_a(pair.first);
  event.set_placement_b(pair.second);
  if (problems_.contains(pair.first) || problems_.contains(pair.second)) {
    event.set_kind(v1::COLLISION_EVENT_KIND_LOST);
    return event;
  }
  event.set_kind(IsCollision(before.relation) ? v1::COLLISION_EVENT_KIND_EXIT
                                              : v1::COLLISION_EVENT_KIND_FAR);
  event.set_relation(v1::RELATION_SEPARATED);
  if (open_.has_clearance()) event.set_within_clearance(false);
  for (const auto& [placement, set] :
       {std::pair(pair.first, &v1::CollisionEvent::set_revision_a),
        std::pair(pair.second, &v1::CollisionEvent::set_revision_b)}) {
    const auto revision = revisions_.find(HullOf(placement));
    if (revision != revisions_.end()) (event.*set)(revision->second);
  }
  return event;
}

}  // namespace hulld
