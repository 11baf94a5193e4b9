#ifndef HULLD_TESTS_FUZZ_SERVICE_WATCH_CHECK_H_
#define HULLD_TESTS_FUZZ_SERVICE_WATCH_CHECK_H_

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "hulld/v1/collision.pb.h"
#include "hulld/v1/hull.pb.h"

namespace hulld::fuzz {

// Whether it goes on behind what an earlier watch was told.
bool Resumes(const v1::WatchHullsRequest& request);

// Follows one WatchHulls call: what its client knows of the hulls. Functions return what is wrong
// with a message, or nothing.
class HullWatchCheck {
 public:
  explicit HullWatchCheck(v1::WatchHullsRequest request) : request_(std::move(request)) {}

  std::string Received(const v1::WatchHullsResponse& response);

  // Whether the watch tells of this hull.
  bool Watches(const std::string& hull_id) const;
  // By ID. Complete once synced, unless the watch resumed another.
  const std::map<std::string, v1::HullInfo>& hulls() const { return hulls_; }
  bool is_synced() const { return is_synced_; }
  bool is_anew() const { return is_anew_; }
  const v1::ResponseHeader& header() const { return header_; }

 private:
  std::string TakeEvent(const v1::HullEvent& event);

  const v1::WatchHullsRequest request_;
  std::map<std::string, v1::HullInfo> hulls_;
  // Those that were told of.
  std::set<std::string> bodies_;
  v1::ResponseHeader header_;
  bool is_synced_ = false;
  bool is_anew_ = false;
};

// Follows one WatchCollisions call: what its client knows of the pairs.
class CollisionWatchCheck {
 public:
  // open: with placements that are not packed.
  explicit CollisionWatchCheck(v1::CollisionWatchOpen open);

  // Messages are numbered from 0, the opening one.
  void Sent(const v1::CollisionWatchUpdate& update);
  std::string Received(const v1::WatchCollisionsResponse& response);

  // Whether all that was sent has been told of.
  bool is_settled() const { return is_synced_ && told_update_ == sent_; }
  // What was told of pairs that touch or overlap, named by the lower index first.
  std::map<std::pair<uint32_t, uint32_t>, v1::Relation> Colliding() const;
  // The question of a batch about all pairs that are watched, as they are by now.
  v1::BatchCheckCollisionsRequest AsBatch() const;

 private:
  using Pair = std::pair<uint32_t, uint32_t>;
  struct State {
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    bool is_near = false;
  };

  bool IsWatched(const Pair& pair) const;
  std::string TakeEvent(const v1::CollisionEvent& event);

  v1::CollisionWatchOpen open_;
  // Where pairs are named: each, as often as it is named.
  std::map<Pair, int> named_;
  std::map<Pair, State> told_;
  // Since the last `synced`.
  std::set<Pair> told_now_;
  uint64_t sent_ = 0;
  uint64_t told_update_ = 0;
  uint64_t revision_ = 0;
  bool is_synced_ = false;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_WATCH_CHECK_H_
