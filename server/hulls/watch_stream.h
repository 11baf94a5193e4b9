#ifndef HULLD_SERVER_HULLS_WATCH_STREAM_H_
#define HULLD_SERVER_HULLS_WATCH_STREAM_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <mutex>

#include "hulld/v1/hull.pb.h"
#include "server/call/pulled_stream.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/registry/watch/change_feed.h"

namespace hulld::server {

// A WatchHulls call. Sends one batch of changes after another. If no change is pending, the feed
// calls back later, so no thread blocks.
class WatchStream : public RequestStream<PulledStream<WriteReactor, v1::WatchHullsResponse>,
                                         v1::WatchHullsRequest> {
 public:
  WatchStream(CallContext& context, Admission& admission, Registry& registry, TaskPool& readers,
              const Bytes& request)
      : RequestStream(request, context, admission, Rpc::kWatchHulls),
        registry_(registry),
        readers_(readers) {}

 private:
  void Open() override;
  void OnSent() override;
  void OnCancel() override;
  void OnRevoked() override { Nudge(); }
  void OnDone() override;

  void Begin(const WatchTarget& target, const WatchPosition& position);
  absl::StatusOr<WatchTarget> ReadTarget() const;
  absl::StatusOr<WatchPosition> ReadPosition() const;
  void SendNext();
  absl::Status LoadBoxes(WatchBatch* batch);
  void SendBatch(const WatchBatch& batch);
  // Makes the stream check whether it should stop.
  void Nudge();

  Registry& registry_;
  TaskPool& readers_;
  // Guards the assignment and reset of watch_ against threads that cancel.
  std::mutex watch_mutex_;
  std::shared_ptr<Watch> watch_;
  // True after the existing hulls were sent.
  bool is_synced_ = false;
  // The revision of the last header.
  uint64_t sent_revision_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_WATCH_STREAM_H_
