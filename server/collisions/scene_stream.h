#ifndef HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_
#define HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/query/body/meeting_pieces.h"
#include "core/query/motion/first_contact.h"
#include "core/query/scene/scene.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/pieced_replies.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/ranked_pairs.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// Counts of candidates, and of found pairs by relation; UNSPECIFIED: without an answer.
struct PairCounts {
  uint64_t candidates = 0;
  std::array<uint64_t, v1::Relation_ARRAYSIZE> found = {};
};

// A range of placements, each to be queried against its successors, or of ranked pairs.
struct ScenePiece : Piece<v1::FindCollisionsResponse> {
  // Remaining candidates of placement `next`, if it was started.
  bool has_candidates = false;
  SceneCandidates candidates;
  // A candidate whose pairs of pieces are answered one by one.
  struct Bodies {
    uint32_t b;
    MeetingPieces pieces;
  };
  std::optional<Bodies> bodies;
  // Counts since the last delivery of the piece.
  PairCounts counts;

  size_t held_bytes() const {
    return candidates.MemoryBytes() + row_bytes +
           (bodies.has_value() ? bodies->pieces.MemoryBytes() : 0);
  }
};

// A FindCollisions call: resolves each hull once and builds the tree of boxes, on a reader thread,
// then searches ranges of placements on all threads of the pool. Both gathering and querying the
// candidates of a placement are split into slices. With a limit or first_only, this search only
// ranks the pairs. The units that follow are the nearest or the first pairs, which are then
// answered.
class SceneStream
    : public PiecedReplies<v1::FindCollisionsRequest, v1::FindCollisionsResponse, ScenePiece> {
 public:
  SceneStream(CallContext& context, const ServiceParts& parts, const Bytes& request);

 private:
  absl::Status Validate() override;
  absl::Status Prepare() override;
  absl::Status Step(ScenePiece& piece, Clock::time_point end) override;
  size_t HeldBytes() const override;
  // The functions below require the mutex.
  uint64_t CountUnits() override { return search_->size(); }
  uint64_t CountFollowingUnits() override;
  void Deliver(ScenePiece& piece) override;
  void OnAllDelivered() override;

  // Called without the mutex.
  absl::Status ValidateChoice() const;
  // Answers the next ranked pair. CANCELLED.
  absl::Status AnswerRanked(ScenePiece& piece);
  // Starts to answer the pairs of pieces of a candidate.
  void OpenBodies(uint32_t a, uint32_t b, ScenePiece& piece) const;
  // Answers one of these pairs. CANCELLED.
  absl::Status AdvanceBodies(uint32_t a, ScenePiece& piece);
  // Answers a candidate and counts it. In a scene with a limit, answers only its relation and
  // clearance. CANCELLED.
  absl::StatusOr<PlacedAnswer> AskCandidate(uint32_t a, uint32_t b, ScenePiece& piece);
  // Answers a pair of a scene with first_only. The pair counts as separated if it is separated
  // until the earliest known contact.
  PlacedAnswer AskFirst(uint32_t a, uint32_t b, MotionOptions motion) const;
  // Ranks a found pair by its separation or, in motion, its first contact. CANCELLED.
  // RESOURCE_EXHAUSTED: --memory-limit.
  absl::Status Rank(uint32_t a, uint32_t b, PlacedAnswer found, ScenePiece& piece);
  // Adds a row; returns its relation.
  v1::Relation AddFound(uint32_t a, uint32_t b, const PlacedAnswer& answer, ScenePiece& piece);

  // Written before the first piece.
  SceneOptions options_;
  std::vector<GroupPair> ignored_groups_;
  std::optional<SceneSearch> search_;
  // With a limit or first_only: the query of the pairs that are answered at the end, and the pairs
  // ranked so far.
  QueryOptions ranked_query_;
  std::unique_ptr<RankedPairs> ranking_;
  // Written before the first piece of ranked pairs.
  std::vector<RankedPair> ranked_;

  // Guarded by the mutex.
  PairCounts counts_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_
