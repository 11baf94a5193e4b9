#ifndef HULLD_SERVER_HULLS_WATCH_STREAM_H_
#define HULLD_SERVER_HULLS_WATCH_STREAM_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstdint>
#include <memory>

#include "hulld/v1/hull.pb.h"
#include "server/call/pulled_stream.h"
#include "server/call/service_parts.h"
#include "server/registry/watch/change_feed.h"

namespace hulld::server {

// A WatchHulls call. Sends one batch of changes after another. If no change is pending, the feed
// calls back later, so no thread blocks.
class WatchStream : public RequestStream<PulledStream<WriteReactor, v1::WatchHullsResponse>,
                                         v1::WatchHullsRequest> {
 public:
  WatchStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
      : RequestStream(request, context, parts.admission, Rpc::kWatchHulls), parts_(parts) {}

 private:
  void Open() override;
  void OnSent() override;
  void OnCancel() override;
  void OnRevoked() override { Nudge(); }
  void OnDone() override;

  absl::Status Begin();
  absl::StatusOr<WatchTarget> ReadTarget() const;
  void SendNext();
  absl::Status LoadBoxes(WatchBatch* batch);
  void SendBatch(const WatchBatch& batch);
  // Makes the stream check whether it should stop.
  void Nudge();

  const ServiceParts& parts_;
  // Read by threads that cancel.
  std::atomic<std::shared_ptr<Watch>> watch_;
  // True after the existing hulls were sent.
  bool is_synced_ = false;
  // The revision of the last header.
  uint64_t sent_revision_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_WATCH_STREAM_H_
