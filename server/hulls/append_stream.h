#ifndef HULLD_SERVER_HULLS_APPEND_STREAM_H_
#define HULLD_SERVER_HULLS_APPEND_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "hulld/v1/hull.pb.h"
#include "server/call/call.h"
#include "server/registry/registry.h"

namespace hulld::server {

// One AppendPoints call. It reads a chunk, queues it at the registry, and reads ahead one chunk at
// most of the one that is being built, so that a fast client fills gRPC's window and not our
// memory; what was built waits for its commit without its points. An ack that cannot be sent yet
// because the one before is still on its way is merged with the next.
//
// All state is guarded by one mutex, under which reads, writes and the end are started; gRPC calls
// back without it.
class AppendStream
    : public grpc::ServerBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse>,
      public std::enable_shared_from_this<AppendStream> {
 public:
  static grpc::ServerBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Registry& registry);

 private:
  AppendStream(grpc::CallbackServerContext& context, Admission& admission, Registry& registry)
      : registry_(registry), call_(context, admission, Rpc::kAppendPoints) {}

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  // The rest requires the mutex.
  void HandleMessage();
  void HandleOpen(const v1::AppendOpen& open);
  void HandleChunk(const v1::AppendChunk& message);
  void HandleOpened(const absl::StatusOr<OpenResult>& opened);
  void HandleResult(uint64_t sequence, const absl::StatusOr<ChunkResult>& result);
  void End(const absl::Status& status);
  void EndAt(uint64_t sequence, const absl::Status& status);
  void Proceed();

  Registry& registry_;
  Call call_;
  // Keeps this alive until gRPC is done with it; a queued chunk holds another reference.
  std::shared_ptr<AppendStream> self_;

  std::mutex mutex_;
  v1::AppendPointsRequest request_;
  std::optional<AppendSession> session_;
  std::string writer_id_;
  // Waits to be sent; an ack grows while it waits.
  std::optional<v1::AppendPointsResponse> next_reply_;
  v1::AppendPointsResponse reply_in_flight_;
  bool reading_ = false;
  bool opening_ = false;
  // Chunks that still hold their points, and those that are not committed or refused.
  int unbuilt_ = 0;
  int uncommitted_ = 0;
  bool writing_ = false;
  bool finished_ = false;
  // Set once the stream is to end, which it does when the replies before are sent.
  std::optional<absl::Status> end_;
  // The chunk that end_ is about, if it is about one: an error of an earlier one tells more.
  uint64_t end_sequence_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_APPEND_STREAM_H_
