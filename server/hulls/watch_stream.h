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

// One WatchHulls call. Takes the next changes from the registry, sends them, and takes more after
// they are written. If none are pending, the registry calls back; no thread waits.
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
  // Makes the stream check if it should stop.
  void Nudge();

  Registry& registry_;
  WorkerPool& readers_;
  // Guards the creation and release of watch_ against threads that cancel; it does not change in
  // between.
  std::mutex watch_mutex_;
  std::shared_ptr<ChangeWatch> watch_;
  // The initial state has been sent.
  bool is_synced_ = false;
  // Revision of the last sent header.
  uint64_t sent_revision_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_WATCH_STREAM_H_
