#ifndef HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/call.h"
#include "server/collisions/placement_table.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// One StreamCollisions call: reads a message, answers it on a reader thread (or where it arrives,
// if that takes no time), sends the answer, and only then reads the next, so that a fast client
// fills gRPC's window and not our memory. Long answers are computed in slices, between which other
// calls get their turn, and sent in pieces.
//
// At any time one of a read, a task and a write is under way, and nothing else touches the state;
// so it needs no mutex.
class CollisionStream
    : public grpc::ServerBidiReactor<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>,
      public std::enable_shared_from_this<CollisionStream> {
 public:
  static grpc::ServerBidiReactor<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
      WorkerPool& readers, WorkerPool& long_readers);

 private:
  // What is kept of a pair from one answer to the next.
  struct PairState {
    uint32_t a;
    uint32_t b;
    PairCache cache;
    // As answered last.
    v1::Relation relation = v1::RELATION_UNSPECIFIED;
  };

  CollisionStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
                  WorkerPool& readers, WorkerPool& long_readers)
      : registry_(registry),
        readers_(readers),
        long_readers_(long_readers),
        call_(context, admission, Rpc::kStreamCollisions),
        charge_(registry.memory()) {}

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { self_.reset(); }

  void ReadNext();
  void End(const absl::Status& status);
  bool IsQuick() const;
  void Handle();
  absl::Status HandleMessage();
  absl::Status HandleOpen();
  absl::Status ChargeFor(size_t pairs);
  absl::Status HandleUpdate(const v1::CollisionStreamUpdate& update);
  absl::Status Refresh();
  void AskAbout(uint32_t pair);
  void AskAboutPairsOf(size_t placement);
  absl::StatusOr<Answer> AnswerPair(PairState& pair) const;
  void AddAnswer(uint32_t index);
  void AnswerSlice(std::chrono::milliseconds time);
  void Send(bool last);

  Registry& registry_;
  WorkerPool& readers_;
  WorkerPool& long_readers_;
  Call call_;
  // Of placements and pairs. Goes before the call, which keeps the server alive.
  MemoryCharge charge_;
  // Keeps this alive until gRPC is done with it; a queued task holds another reference.
  std::shared_ptr<CollisionStream> self_;

  v1::StreamCollisionsRequest request_;
  v1::StreamCollisionsResponse response_;
  size_t response_bytes_ = 0;
  uint64_t messages_ = 0;

  // From `open`.
  bool open_ = false;
  bool only_changes_ = false;
  v1::Wanted wanted_;
  QueryOptions options_;
  PlacementTable table_;
  // The first row of the table that is still to be told; all rows when none is.
  size_t next_row_ = 0;
  std::vector<PairState> pairs_;
  // The pairs of placement i: pairs_of_[pairs_begin_[i]] up to pairs_begin_[i + 1].
  std::vector<uint32_t> pairs_of_;
  std::vector<size_t> pairs_begin_;

  // Of the message that is being answered: the pairs to answer, ascending, and the next of them.
  std::vector<uint32_t> asked_;
  std::vector<char> is_asked_;
  size_t next_asked_ = 0;
  RungCounts rungs_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_
