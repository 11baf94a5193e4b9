#ifndef HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_
#define HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/query/scene/scene.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/pieced_replies.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/process/task_pool.h"
#include "server/process/worker_pool.h"
#include "server/shards/shards.h"

namespace hulld::server {

// A range of placements, each to be asked about with those after it.
struct ScenePiece : Piece<v1::FindCollisionsResponse> {
  // The candidates of placement `next` that are still to be asked about, once they were begun with.
  bool has_candidates = false;
  SceneCandidates candidates;
  // What was counted since the piece was delivered last.
  v1::SceneTotals totals;
  RungCounts rungs;

  size_t held_bytes() const { return candidates.MemoryBytes(); }
};

// One FindCollisions call: resolves every hull once and builds the tree of boxes, on a reader
// thread, then searches ranges of placements on all threads of the pool. Gathering the candidates
// of one placement is cut into slices like asking about them.
class SceneStream
    : public PiecedReplies<v1::FindCollisionsRequest, v1::FindCollisionsResponse, ScenePiece> {
 public:
  static WriteReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                             Shards& shards, const PieceThreads& threads,
                             const grpc::ByteBuffer& request);

 private:
  SceneStream(grpc::CallbackServerContext& context, Admission& admission, Shards& shards,
              const PieceThreads& threads, const grpc::ByteBuffer& request);

  bool IsShort() const override;
  absl::Status Validate() override;
  std::span<const std::string> HullIds() const override { return table_.hull_ids(); }
  const ShardsFreshness& freshness() const override { return freshness_; }
  absl::StatusOr<bool> ResolveHulls(bool may_wait) override;
  absl::Status Prepare() override;
  absl::Status Advance(ScenePiece& piece, Clock::time_point end) override;
  size_t HeldBytes() const override;
  // The rest requires the mutex.
  bool QueueHead() override;
  uint64_t CountUnits() override { return search_->size(); }
  void Deliver(ScenePiece& piece) override;
  bool Join(const v1::FindCollisionsResponse& reply, v1::FindCollisionsResponse* waiting) override;
  void OnAllDelivered() override;

  // Without the mutex.
  size_t AddFound(uint32_t a, uint32_t b, const PlacedAnswer& answer, ScenePiece& piece,
                  v1::FindCollisionsResponse* reply);

  // Written before the first piece.
  SceneOptions options_;
  ShardsFreshness freshness_;
  std::vector<GroupPair> ignored_groups_;
  PlacementTable table_;
  std::optional<SceneSearch> search_;

  // Guarded by the mutex.
  // The first row of the table of hulls that is still to be told.
  size_t next_row_ = 0;
  v1::SceneTotals totals_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_SCENE_STREAM_H_
