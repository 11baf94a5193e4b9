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
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// One WatchHulls call: takes what is to be told next from the registry, sends it, and comes for
// more once that was written. When there is nothing, the registry calls back; no thread waits.
class WatchStream : public RequestStream<PulledStream<WriteReactor, v1::WatchHullsResponse>,
                                         v1::WatchHullsRequest> {
 public:
  static WriteReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                             Registry& registry, WorkerPool& readers,
                             const grpc::ByteBuffer& request);

 private:
  WatchStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
              WorkerPool& readers, const grpc::ByteBuffer& request)
      : RequestStream(request, context, admission, Rpc::kWatchHulls),
        registry_(registry),
        readers_(readers) {}

  void Open() override;
  void OnSent() override;
  void OnCancel() override;
  void OnRevoked() override { Nudge(); }
  void OnDone() override;

  void Begin(const WatchTarget& target, const WatchStart& start);
  absl::StatusOr<WatchTarget> ReadTarget() const;
  absl::StatusOr<WatchStart> ReadStart() const;
  void TellNext();
  absl::Status LoadBoxes(WatchPiece* piece);
  void Tell(const WatchPiece& piece);
  // Has it look whether it should stop.
  void Nudge();

  Registry& registry_;
  WorkerPool& readers_;
  // Guards the beginning and the end of watch_ against threads that cancel. Between these it stays.
  std::mutex watch_mutex_;
  std::shared_ptr<ChangeWatch> watch_;
  // What was there has been told.
  bool is_synced_ = false;
  // The revision in the header that was sent last.
  uint64_t sent_revision_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_WATCH_STREAM_H_
