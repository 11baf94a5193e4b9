#ifndef HULLD_SERVER_HULLS_APPEND_STREAM_H_
#define HULLD_SERVER_HULLS_APPEND_STREAM_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <optional>
#include <string>

#include "hulld/v1/hull.pb.h"
#include "server/call/queued_stream.h"
#include "server/call/service_parts.h"
#include "server/hulls/in_order.h"

namespace hulld::server {

// An AppendPoints call. Reads a chunk, queues it in the registry, and reads at most one chunk ahead
// of the one being built, so a fast client fills gRPC's window rather than the server's memory.
// Built chunks drop their points before they wait for their commit. An ack that must wait for the
// previous one is merged with the next. Reading does not wait for writing, so a client may send
// everything before it reads an ack.
class AppendStream : public ReadingStream<QueuedStream<BidiReactor, v1::AppendPointsResponse>,
                                          v1::AppendPointsRequest> {
 public:
  AppendStream(CallContext& context, const ServiceParts& parts)
      : ReadingStream(context, parts.admission, Rpc::kAppendPoints), parts_(parts) {}

 private:
  struct SequenceResult {
    uint64_t sequence = 0;
    absl::StatusOr<ChunkResult> result;
  };

  void OnDone() override;

  // The members below require the mutex.
  void StartWork() override;
  bool IsWorking() const override { return opening_ || unbuilt_ > 0 || uncommitted_ > 0; }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override;
  absl::Status HandleOpen(const v1::AppendOpen& open);
  absl::Status HandleChunk(const v1::AppendChunk& message);
  void HandleOpened(const absl::StatusOr<OpenResult>& opened);
  void HandleResult(const SequenceResult& chunk);
  void LogApplied();
  void Fail(const absl::Status& status);

  const ServiceParts& parts_;
  std::optional<AppendSession> session_;
  std::string hull_id_;
  std::string writer_id_;
  // Committed work of this stream, for its log line.
  uint64_t applied_chunks_ = 0;
  uint64_t applied_points_ = 0;
  uint64_t last_revision_ = 0;
  bool opening_ = false;
  // Number of chunks that still have their points, and of chunks neither committed nor refused.
  int unbuilt_ = 0;
  int uncommitted_ = 0;
  // Acks are cumulative, and the error of the earliest refused chunk is the most specific.
  InOrder<SequenceResult> results_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_APPEND_STREAM_H_
