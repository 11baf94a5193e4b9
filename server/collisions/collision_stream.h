#ifndef HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/pulled_stream.h"
#include "server/collisions/claimed_range.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/process/task_pool.h"
#include "server/process/worker_pool.h"
#include "server/shards/shards.h"
#include "server/shards/waiting_calls.h"

namespace hulld::server {

// One StreamCollisions call: reads a message, answers it, sends the answer, and only then reads the
// next, so that a fast client fills gRPC's window and not our memory. A message that takes no time
// is answered where it arrives, one that resolves hulls on a reader thread, and others on the pool.
// Long answers are computed in slices, between which other calls get their turn, and sent in
// pieces. Where the relation of hulls is all that is wanted, other threads of the pool help with a
// step: they take slices, so they wait where others have to.
class CollisionStream
    : public ReadingStream<PulledStream<BidiReactor, v1::StreamCollisionsResponse>,
                           v1::StreamCollisionsRequest> {
 public:
  static BidiReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                            Shards& shards, WorkerPool& readers, WorkerPool& long_readers,
                            TaskPool& pool, WaitingCalls& waiting);

 private:
  // What is kept of a pair from one answer to the next.
  struct PairState {
    uint32_t a;
    uint32_t b;
    PairCache cache;
    // As answered last.
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
  };

  // What was found of a pair.
  struct Decided {
    // As a v1::Relation; unspecified where a placement has a problem, which is told elsewhere.
    uint8_t relation = 0;
    Rung rung = Rung::kBounds;
    // Whether it was answered otherwise before.
    bool is_changed = false;
  };

  CollisionStream(grpc::CallbackServerContext& context, Admission& admission, Shards& shards,
                  WorkerPool& readers, WorkerPool& long_readers, TaskPool& pool,
                  WaitingCalls& waiting)
      : ReadingStream(context, admission, Rpc::kStreamCollisions),
        shards_(shards),
        readers_(readers),
        long_readers_(long_readers),
        pool_(pool),
        lane_(pool),
        waiting_(waiting),
        charge_(shards.memory(), MemoryUse::kReading) {}

  void Open() override { Read(); }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override { FinishCall(OrStopped(why)); }
  void OnSent() override;

  bool IsQuick() const;
  bool IsPlain() const { return AsksRelationsOfHulls(options_, table_); }
  void Handle();
  absl::Status HandleMessage();
  absl::Status OfMessage(const absl::Status& status) const;
  absl::Status HandleOpen();
  absl::Status ChargeFor(size_t pairs);
  absl::Status HandleUpdate(const v1::CollisionStreamUpdate& update);
  absl::Status Refresh(const ShardsPlan& plan);
  void AnswerMessage(absl::Status status);
  void AskAbout(uint32_t pair);
  void AskAboutPairsOf(size_t placement);
  void AddAnswer(uint32_t index);
  void DecideTogether();
  bool BeginDeciding();
  ClaimedRange::Block Claim();
  void TakePart();
  void Decide(uint32_t i);
  void TellDecided();
  void AnswerSlice();
  void SendAnswered();
  void SendPart(bool last);

  Shards& shards_;
  WorkerPool& readers_;
  WorkerPool& long_readers_;
  TaskPool& pool_;
  // The slices of long answers.
  TaskPool::Lane lane_;
  WaitingCalls& waiting_;
  // Covers placements and pairs.
  MemoryCharge charge_;

  // The size of the reply, estimated.
  size_t reply_bytes_ = 0;
  uint64_t messages_ = 0;

  // From `open`.
  bool open_ = false;
  bool only_changes_ = false;
  ShardsFreshness freshness_;
  // How the current message has the hulls looked up, if it does.
  std::optional<ShardsPlan> refresh_;
  v1::Wanted wanted_;
  QueryOptions options_;
  PlacementTable table_;
  // The first row of the table that is still to be told; all rows when none is.
  size_t next_row_ = 0;
  std::vector<PairState> pairs_;
  // The pairs of placement i: pairs_of_[pairs_begin_[i]] up to pairs_begin_[i + 1].
  std::vector<uint32_t> pairs_of_;
  std::vector<size_t> pairs_begin_;

  // The pairs that the current message asks about, ascending, and the next of them to answer.
  std::vector<uint32_t> asked_;
  std::vector<char> is_asked_;
  size_t next_asked_ = 0;
  RungCounts rungs_;

  // The placements that the current message moved and that are not placed yet.
  std::vector<uint32_t> moved_;

  // A plain answer is decided as a whole, by several threads, and then told.
  bool is_decided_ = false;
  // Parallel to asked_.
  std::vector<Decided> decided_;
  // What no thread has begun with: entries of moved_ while they are placed, and then entries of
  // asked_.
  ClaimedRange unclaimed_;
  std::atomic<bool> is_placing_ = false;
  // Slices of helpers that wait for their turn.
  std::atomic<size_t> helpers_waiting_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_
