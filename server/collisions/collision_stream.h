#ifndef HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/pulled_stream.h"
#include "server/call/service_parts.h"
#include "server/collisions/claimed_range.h"
#include "server/collisions/placed/live_pairs.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/placed/query_settings.h"
#include "server/process/task_pool.h"

namespace hulld::server {

// A StreamCollisions call: reads a message, answers it, sends the answer, and only then reads the
// next message, so that a fast client fills gRPC's window rather than the server's memory. A quick
// message is answered on arrival, a message that resolves hulls on a reader thread, and any other
// on the pool. Long answers are computed in slices, which alternate with other calls, and sent in
// pieces. If only relations of hulls are wanted, other threads of the pool help with a step. They
// run slices, so they yield to other calls.
class CollisionStream
    : public ReadingStream<PulledStream<BidiReactor, v1::StreamCollisionsResponse>,
                           v1::StreamCollisionsRequest> {
 public:
  CollisionStream(CallContext& context, const ServiceParts& parts)
      : ReadingStream(context, parts.admission, Rpc::kStreamCollisions),
        parts_(parts),
        lane_(parts.pool),
        charge_(parts.registry.memory(), MemoryUse::kReading) {}

 private:
  // Result of a pair.
  struct Decided {
    // A v1::Relation; unspecified if a placement has a problem, which is reported elsewhere.
    uint8_t relation = 0;
    Rung rung = Rung::kBounds;
    // True if the previous answer differed.
    bool is_changed = false;
  };

  void Open() override { Read(); }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override { FinishCall(OrStopped(why)); }
  void OnSent() override;

  bool IsQuick() const;
  void Handle();
  absl::Status HandleMessage();
  absl::Status OfMessage(const absl::Status& status) const;
  absl::Status HandleOpen();
  absl::Status ChargeFor(size_t pairs);
  absl::Status HandleUpdate(const v1::CollisionStreamUpdate& update);
  absl::Status Refresh(const ReadPlan& plan);
  void AnswerMessage(absl::Status status);
  void AddAnswer(uint32_t index);
  void DecideTogether();
  void TakePart();
  void Decide(uint32_t i);
  void AddDecided(size_t i);
  void AnswerSlice();
  void SendPart(bool last);

  const ServiceParts& parts_;
  // Slices of long answers.
  TaskPool::Lane lane_;
  // Covers placements and pairs.
  MemoryCharge charge_;

  // Estimated size of the reply.
  size_t reply_bytes_ = 0;
  uint64_t messages_ = 0;

  // Set by `open`.
  bool open_ = false;
  bool only_changes_ = false;
  Freshness freshness_;
  // Plan for looking up the hulls, if the current message requires it.
  std::optional<ReadPlan> refresh_;
  v1::Wanted wanted_;
  QueryOptions options_;
  PlacementTable table_;
  // Next row of the table to send; table_rows() if none is left.
  size_t next_row_ = 0;
  // The current message queries the selected pairs, in ascending order.
  LivePairs pairs_;
  // Index of the next selected pair to answer.
  size_t next_asked_ = 0;
  RungCounts rungs_;

  // Results of a plain answer, decided by several threads; then parallel to the selected pairs.
  std::vector<Decided> decided_;
  // Selected pairs that no thread has claimed yet.
  ClaimedRange unclaimed_;
  // Queued slices of helpers.
  std::atomic<size_t> helpers_waiting_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_STREAM_H_
