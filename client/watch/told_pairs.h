#ifndef HULLD_CLIENT_WATCH_TOLD_PAIRS_H_
#define HULLD_CLIENT_WATCH_TOLD_PAIRS_H_

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "hulld/v1/collision.pb.h"

namespace hulld {

// What a WatchCollisions call has told of pairs. Where another call takes its place, which begins
// by telling everything, this leaves out what is known and adds what ended in between: so the two
// calls tell what one would have told. Memory: the pairs that collide or are near.
class ToldPairs {
 public:
  // `open` as the watch was opened: names the hulls of placements, and whether there is a
  // clearance.
  explicit ToldPairs(const v1::CollisionWatchOpen& open);

  // The next message is the first of another call.
  void StartAnew();
  // Takes note of a message, after making of it what it would be had there been one call.
  void Take(v1::WatchCollisionsResponse* message);

 private:
  using Pair = std::pair<uint32_t, uint32_t>;
  struct State {
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    bool within_clearance = false;
  };

  // Empty for a placement that does not exist.
  const std::string& HullOf(uint32_t placement) const;
  void TakeHulls(const v1::WatchCollisionsResponse& message);
  void TakeProblems(v1::WatchCollisionsResponse* message);
  void TakeEvents(v1::WatchCollisionsResponse* message);
  // Notes the state of the event's pair. False: it was known, and there is no event.
  bool TakeEvent(v1::CollisionEvent* event);
  // The events of pairs that the other call did not tell of.
  void TellWhatEnded(v1::WatchCollisionsResponse* message);
  v1::CollisionEvent EndOf(const Pair& pair, const State& before) const;

  // Placements and clearance, without poses.
  v1::CollisionWatchOpen open_;
  // Those that collide or are within the clearance.
  std::map<Pair, State> told_;
  std::map<uint32_t, std::string> problems_;
  std::map<std::string, uint64_t> revisions_;
  // From StartAnew until `synced`: the pairs that the present call told of.
  std::optional<std::set<Pair>> retold_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_TOLD_PAIRS_H_
