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

// True if the watch resumes an earlier one.
bool Resumes(const v1::WatchHullsRequest& request);

// Follows one WatchHulls call and its client's knowledge of the hulls. Functions return the fault
// of a message, or empty.
class HullWatchCheck {
 public:
  explicit HullWatchCheck(v1::WatchHullsRequest request) : request_(std::move(request)) {}

  std::string Received(const v1::WatchHullsResponse& response);

  // Returns true if the watch covers this hull.
  bool Watches(const std::string& hull_id) const;
  // By ID. Complete after synced, unless the watch resumed another.
  const std::map<std::string, v1::HullInfo>& hulls() const { return hulls_; }
  bool is_synced() const { return is_synced_; }
  bool is_restarted() const { return is_restarted_; }
  const v1::ResponseHeader& header() const { return header_; }

 private:
  std::string TakeEvent(const v1::HullEvent& event);

  const v1::WatchHullsRequest request_;
  std::map<std::string, v1::HullInfo> hulls_;
  // Bodies reported.
  std::set<std::string> bodies_;
  v1::ResponseHeader header_;
  bool is_synced_ = false;
  bool is_restarted_ = false;
};

// Follows one WatchCollisions call and its client's knowledge of the pairs.
class CollisionWatchCheck {
 public:
  // open: its placements must not be packed.
  explicit CollisionWatchCheck(v1::CollisionWatchOpen open);

  // Messages are numbered from 0, the opening one.
  void Sent(const v1::CollisionWatchUpdate& update);
  std::string Received(const v1::WatchCollisionsResponse& response);

  // True if everything sent has been answered.
  bool is_settled() const { return is_synced_ && reported_update_ == sent_; }
  // Returns the reported pairs that touch or overlap, lower index first.
  std::map<std::pair<uint32_t, uint32_t>, v1::Relation> Colliding() const;
  // Returns a batch of all watched pairs in their current state.
  v1::BatchCheckCollisionsRequest AsBatch() const;

 private:
  using Pair = std::pair<uint32_t, uint32_t>;
  struct State {
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
    bool is_near = false;
  };

  // create_revision and revision of a hull or body.
  using Version = std::pair<uint64_t, uint64_t>;

  bool IsWatched(const Pair& pair) const;
  std::string CheckSent(uint32_t placement, uint64_t revision, bool has_piece,
                        const v1::DecidingPiece& piece) const;
  std::string TakeEvent(const v1::CollisionEvent& event);

  v1::CollisionWatchOpen open_;
  // For explicitly named pairs: their multiplicity.
  std::map<Pair, int> named_;
  std::map<Pair, State> reported_;
  // Last version sent, by ID.
  std::map<std::string, Version> versions_;
  // Since the last `synced`.
  std::set<Pair> reported_now_;
  uint64_t sent_ = 0;
  uint64_t reported_update_ = 0;
  uint64_t revision_ = 0;
  bool is_synced_ = false;
};

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_WATCH_CHECK_H_
