#ifndef HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_
#define HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/query/batch.h"
#include "core/query/collision.h"
#include "core/query/motion/first_contact.h"
#include "hulld/v1/collision.pb.h"
#include "server/collisions/pieced_replies.h"
#include "server/collisions/placed/placed_answer.h"
#include "server/collisions/placed/placement_table.h"
#include "server/process/task_pool.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/wire/batch_columns.h"

namespace hulld::server {

// A range of pairs, and the textbook's progress with the next one, if it began.
struct PairsPiece : Piece<v1::BatchCheckCollisionsResponse> {
  std::optional<TextbookCheck> check;

  size_t held_bytes() const { return check.has_value() ? check->MemoryBytes() : 0; }
};

// A BatchCheckCollisions call: resolves each hull a single time, on a reader thread, then answers
// ranges of pairs on all threads of the pool.
class BatchStream : public PiecedReplies<v1::BatchCheckCollisionsRequest,
                                         v1::BatchCheckCollisionsResponse, PairsPiece> {
 public:
  static WriteReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                             Registry& registry, const PieceThreads& threads,
                             const grpc::ByteBuffer& request);

 private:
  BatchStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
              const PieceThreads& threads, const grpc::ByteBuffer& request);

  bool IsShort() const override;
  absl::Status Validate() override;
  const Freshness& freshness() const override { return freshness_; }
  absl::StatusOr<bool> ResolveHulls(bool may_wait) override;
  absl::Status Prepare() override;
  absl::Status Advance(PairsPiece& piece, Clock::time_point end) override;
  size_t HeldBytes() const override { return table_.MemoryBytes(); }
  // The functions below require the mutex.
  bool QueueHead() override;
  uint64_t CountUnits() override { return pair_count_; }
  bool MayRunAhead() const override;
  void Deliver(PairsPiece& piece) override;
  bool Join(const v1::BatchCheckCollisionsResponse& reply,
            v1::BatchCheckCollisionsResponse* waiting) override;
  void OnAllDelivered() override;

  // Without the mutex.
  PlacedPair PairAt(uint64_t i) const;
  bool IsAnswerable(const PlacedPair& pair) const;
  // Answers the next pair of the piece; by the textbook, at least a part of it. CANCELLED.
  absl::Status Answer(PairsPiece& piece, BatchColumns* columns, RungCounts* counts);
  absl::Status AnswerRelation(PairsPiece& piece, BatchColumns* columns, RungCounts* counts);
  absl::Status AnswerByTextbook(PairsPiece& piece, Clock::time_point end, BatchColumns* columns,
                                RungCounts* counts);
  absl::Status Add(PlacedAnswer answer, PairsPiece& piece, BatchColumns* columns,
                   RungCounts* counts);

  // Written before the first piece.
  uint64_t pair_count_ = 0;
  Freshness freshness_;
  QueryOptions options_;
  // If a placement moves.
  MotionOptions motion_options_;
  PlacementTable table_;
  // All pairs are of hulls at rest, and only relations are wanted: AnswerRelation.
  bool is_plain_ = false;

  // Guarded by the mutex. The next row of the table of hulls to send, and the last part of the
  // table, which the first answers join.
  size_t next_row_ = 0;
  v1::BatchCheckCollisionsResponse head_;
  bool has_head_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_BATCH_STREAM_H_
