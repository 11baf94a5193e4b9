#ifndef HULLD_CLIENT_WATCH_COLLISION_WATCH_H_
#define HULLD_CLIENT_WATCH_COLLISION_WATCH_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>

#include "client/calls/retry.h"
#include "client/watch/reported_pairs.h"
#include "hulld/v1/collision.grpc.pb.h"

namespace hulld {

// WatchCollisions, message by message: reports collisions of pairs as they begin and end. After a
// lost connection, the watch resumes: it opens a new call with the current poses, reports the
// changes since the loss without repeating events, and marks their end with another `synced`. Code
// that accumulates the events need not handle lost connections. Next and Update may each be called
// by one thread, not necessarily the same one, and Cancel by any thread.
class CollisionWatch {
 public:
  // Next connects. reconnect_timeout: limits the attempts to connect, and to reconnect to a lost
  // server. The first call and refused calls are retried as `retry` specifies.
  CollisionWatch(std::shared_ptr<v1::CollisionService::Stub> stub, v1::CollisionWatchOpen open,
                 RetryPolicy retry, std::chrono::milliseconds reconnect_timeout);
  // Cancels the watch.
  ~CollisionWatch();
  CollisionWatch(const CollisionWatch&) = delete;
  CollisionWatch& operator=(const CollisionWatch&) = delete;

  // Waits for the next message. An error ends the watch: CANCELLED after Cancel, or an error of the
  // contract.
  absl::StatusOr<v1::WatchCollisionsResponse> Next();

  // Sets the poses of placements. While disconnected, they are kept for the next connection.
  // INVALID_ARGUMENT, without effect: the update names a placement that does not exist, or does not
  // have seven numbers for each placement.
  absl::Status Update(const v1::CollisionWatchUpdate& update);

  // Makes the current and every later call of Next return promptly.
  void Cancel();

 private:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<
        grpc::ClientReaderWriter<v1::WatchCollisionsRequest, v1::WatchCollisionsResponse>>
        stream;
    // Number of updates included in its `open`.
    uint64_t updates_before = 0;
  };

  // Returns null after Cancel.
  std::shared_ptr<Call> Open();
  absl::Status Close(Call& call);

  const std::shared_ptr<v1::CollisionService::Stub> stub_;
  const RetryPolicy retry_;
  const std::chrono::milliseconds reconnect_timeout_;

  // Used by Next only.
  ReportedPairs reported_;
  std::shared_ptr<Call> call_;
  // True after the first message: a server was reached and has reported pairs.
  bool connected_ = false;

  // Acquired before cancel_mutex_. Guards the current poses, the number of updates, and the call
  // that receives them, and ensures that a call begins with `open`.
  std::mutex update_mutex_;
  v1::CollisionWatchOpen open_;
  uint64_t updates_ = 0;
  std::shared_ptr<Call> updated_call_;

  // Guards the call that Cancel ends.
  std::mutex cancel_mutex_;
  std::shared_ptr<Call> cancelled_call_;
  bool cancelled_ = false;
  std::condition_variable cancellation_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_COLLISION_WATCH_H_
