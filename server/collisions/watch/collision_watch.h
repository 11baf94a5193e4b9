#ifndef HULLD_SERVER_COLLISIONS_WATCH_COLLISION_WATCH_H_
#define HULLD_SERVER_COLLISIONS_WATCH_COLLISION_WATCH_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/query/collision.h"
#include "hulld/v1/collision.pb.h"
#include "server/call/queued_stream.h"
#include "server/call/service_parts.h"
#include "server/collisions/placed/live_pairs.h"
#include "server/collisions/placed/placement_table.h"
#include "server/collisions/watch/watched_hulls.h"
#include "server/process/task_pool.h"

namespace hulld::server {

// A WatchCollisions call, which works in rounds. A round processes one message of the client, or
// the pending changes of hulls and bodies, answers the affected pairs again, and sends an event for
// each pair whose answer differs. A round starts after the replies of the previous one are written.
// Until then, messages wait in gRPC's window and changes coalesce in the feed, so a slow client
// costs the memory of a single message.
//
// The mutex guards which task is running. The data of a round belongs to that task alone.
class CollisionWatch : public ReadingStream<QueuedStream<BidiReactor, v1::WatchCollisionsResponse>,
                                            v1::WatchCollisionsRequest> {
 public:
  CollisionWatch(CallContext& context, const ServiceParts& parts)
      : ReadingStream(context, parts.admission, Rpc::kWatchCollisions),
        parts_(parts),
        lane_(parts.pool),
        hulls_(parts.registry),
        charge_(parts.registry.memory(), MemoryUse::kReading) {}

 private:
  void OnDone() override;

  // The functions below require the mutex.
  void StartWork() override;
  bool IsWorking() const override { return is_working_; }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override;

  // The following run as the only task.
  void TakeMessage();
  absl::Status HandleMessage();
  absl::Status HandleOpen(v1::CollisionWatchOpen& open);
  absl::Status HandleUpdate(const v1::CollisionWatchUpdate& update);
  void TakeChanges();
  absl::Status HandleChanges(WatchedHulls::Round round);
  absl::Status BeginRound(const std::vector<uint32_t>& changed);
  void SendRound();
  bool AddHulls();
  absl::Status AnswerPair(LivePair& pair);
  void AddEvent(v1::CollisionEventKind kind, const LivePair& pair,
                const std::optional<PiecePair>& pieces);
  // Ends the task, and the call if `error` is not OK.
  void EndWork(const absl::Status& error);

  const ServiceParts& parts_;
  TaskPool::Lane lane_;

  // Guarded by the mutex.
  bool is_working_ = false;
  // True if a message was read and waits for its round.
  bool has_message_ = false;
  bool has_half_closed_ = false;
  // True if the feed may have changes.
  bool has_changes_ = false;

  // The following belong to the task.
  WatchedHulls hulls_;
  // Covers placements and pairs.
  MemoryCharge charge_;
  bool is_open_ = false;
  QueryOptions options_;
  PlacementTable table_;
  LivePairs pairs_;
  uint64_t messages_ = 0;
  // Every change of a hull up to this revision is included.
  uint64_t revision_ = 0;

  // The current round, and the next of its hulls, problems and pairs to send.
  bool is_sending_ = false;
  bool answers_message_ = false;
  std::vector<size_t> new_hulls_;
  std::vector<HullRecord> new_piece_hulls_;
  std::vector<uint32_t> new_problems_;
  size_t next_hull_ = 0;
  size_t next_piece_hull_ = 0;
  size_t next_problem_ = 0;
  size_t next_pair_ = 0;
  RungCounts rungs_;
  v1::WatchCollisionsResponse reply_;
  // Estimated size of the reply.
  size_t reply_bytes_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCH_COLLISION_WATCH_H_
