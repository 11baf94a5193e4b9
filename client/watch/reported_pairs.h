#ifndef HULLD_CLIENT_WATCH_REPORTED_PAIRS_H_
#define HULLD_CLIENT_WATCH_REPORTED_PAIRS_H_

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "hulld/v1/collision.pb.h"

namespace hulld {

// The pair states reported by a WatchCollisions call. When a new call replaces it and starts with
// the full state, this class removes events that were already reported, and adds end events for
// pairs that no longer collide, so that both calls together report the same events as a single
// call. Memory: the pairs that collide or are near.
class ReportedPairs {
 public:
  // `open` is the watch's first message: it names the hulls of placements and any clearance.
  explicit ReportedPairs(const v1::CollisionWatchOpen& open);

  // Marks the next message as the first of another call.
  void Restart();
  // Rewrites a message to the message that a single call would have sent, and records it.
  void Take(v1::WatchCollisionsResponse* message);

 private:
  using Pair = std::pair<uint32_t, uint32_t>;
  struct State {
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    bool within_clearance = false;
  };

  // Returns an empty ID for a placement that does not exist.
  const std::string& HullOf(uint32_t placement) const;
  void TakeHulls(const v1::WatchCollisionsResponse& message);
  void TakeProblems(v1::WatchCollisionsResponse* message);
  void TakeEvents(v1::WatchCollisionsResponse* message);
  // Records the state of the event's pair. Returns false if that state was already reported, so
  // that the event is dropped.
  bool TakeEvent(v1::CollisionEvent* event);
  // Adds the end events of pairs that the new call did not report.
  void ReportEnded(v1::WatchCollisionsResponse* message);
  v1::CollisionEvent EndOf(const Pair& pair, const State& before) const;

  // Placements and clearance, without poses.
  v1::CollisionWatchOpen open_;
  // Pairs that collide or are within the clearance.
  std::map<Pair, State> reported_;
  std::map<uint32_t, std::string> problems_;
  std::map<std::string, uint64_t> revisions_;
  // From Restart until `synced`: the pairs that the current call has reported.
  std::optional<std::set<Pair>> reported_again_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_REPORTED_PAIRS_H_
