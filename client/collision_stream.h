#ifndef HULLD_CLIENT_COLLISION_STREAM_H_
#define HULLD_CLIENT_COLLISION_STREAM_H_

#include <absl/status/statusor.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/client_callback.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>

#include "hulld/v1/collision.grpc.pb.h"

namespace hulld {

// A StreamCollisions call, step by step: the client sends poses, and the server returns the
// relations of the affected pairs. Never retried, because the server's state ends with the stream.
// Not thread-safe.
class CollisionStream final
    : public grpc::ClientBidiReactor<v1::StreamCollisionsRequest, v1::StreamCollisionsResponse> {
 public:
  // timeout: bounds the wait for each answer. freshness: used for an `open` without a freshness.
  CollisionStream(std::shared_ptr<v1::CollisionService::Stub> stub,
                  std::chrono::milliseconds timeout,
                  std::optional<v1::Freshness> freshness = std::nullopt);
  // Cancels the call unless it has ended, and waits until gRPC releases it.
  ~CollisionStream() override;

  // Sends a message and waits for its complete answer. An error ends the stream, and every later
  // call returns it.
  absl::StatusOr<v1::StreamCollisionsResponse> Open(v1::CollisionStreamOpen open);
  absl::StatusOr<v1::StreamCollisionsResponse> Update(v1::CollisionStreamUpdate update);

  // Half-closes the stream and returns its final status, within the timeout.
  absl::Status Close();

 private:
  absl::StatusOr<v1::StreamCollisionsResponse> Exchange();
  void ReleaseHold();
  absl::Status Ended();
  absl::Status TimeOut();
  absl::Status WaitUntilDone();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  const std::shared_ptr<v1::CollisionService::Stub> stub_;
  const std::chrono::milliseconds timeout_;
  const std::optional<v1::Freshness> freshness_;
  grpc::ClientContext context_;
  v1::StreamCollisionsRequest request_;
  v1::StreamCollisionsResponse incoming_;
  // Keeps the call open while more messages may be sent.
  bool held_ = true;

  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by the mutex, like all members below.
  v1::StreamCollisionsResponse answer_;
  bool answered_ = false;
  bool written_ = false;
  bool reads_ended_ = false;
  bool done_ = false;
  grpc::Status status_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_COLLISION_STREAM_H_
