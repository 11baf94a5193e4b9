#ifndef HULLD_SERVER_HULLS_APPEND_STREAM_H_
#define HULLD_SERVER_HULLS_APPEND_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hulld/v1/hull.pb.h"
#include "server/call/queued_stream.h"
#include "server/shards/shards.h"

namespace hulld::server {

// One AppendPoints call. It reads a chunk, queues it at the shards, and reads ahead one chunk at
// most of the one that is being built, so that a fast client fills gRPC's window and not our
// memory; what was built waits for its commit without its points. An ack that cannot be sent yet
// because the one before is still on its way is merged with the next. Reading does not wait for
// writing, so a client that sends everything before it reads an ack is served too.
class AppendStream : public ReadingStream<QueuedStream<BidiReactor, v1::AppendPointsResponse>,
                                          v1::AppendPointsRequest> {
 public:
  static BidiReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                            Shards& shards);

 private:
  AppendStream(grpc::CallbackServerContext& context, Admission& admission, Shards& shards)
      : ReadingStream(context, admission, Rpc::kAppendPoints), shards_(shards) {}

  void Open() override;
  void OnDone() override;

  // The rest requires the mutex.
  void StartWork() override;
  bool IsWorking() const override { return opening_ || unbuilt_ > 0 || uncommitted_ > 0; }
  void OnMessage() override;
  void OnNoMessage(const absl::Status& why) override;
  void HandleOpen(const v1::AppendOpen& open);
  void HandleChunk(const v1::AppendChunk& message);
  void HandleOpened(const absl::StatusOr<OpenResult>& opened);
  void HandleResult(uint64_t sequence, const absl::StatusOr<ChunkResult>& result);
  // Once the hull is named.
  Registry& registry() { return shards_.of(hull_id_); }
  void LogApplied();
  void Fail(const absl::Status& status);
  void FailAt(uint64_t sequence, const absl::Status& status);

  Shards& shards_;
  std::optional<AppendSession> session_;
  std::string hull_id_;
  std::string writer_id_;
  // What is committed of this stream, for the line in the log that tells of it.
  uint64_t applied_chunks_ = 0;
  uint64_t applied_points_ = 0;
  uint64_t last_revision_ = 0;
  bool opening_ = false;
  // Chunks that still hold their points, and those that are not committed or refused.
  int unbuilt_ = 0;
  int uncommitted_ = 0;
  // The chunk that the end is about, if it is about one: an error of an earlier one tells more.
  uint64_t end_sequence_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_APPEND_STREAM_H_
