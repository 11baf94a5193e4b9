#ifndef HULLD_CLIENT_WATCH_COLLISION_WATCH_H_
#define HULLD_CLIENT_WATCH_COLLISION_WATCH_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>

#include "client/calls/retry.h"
#include "client/watch/told_pairs.h"
#include "hulld/v1/collision.grpc.pb.h"

namespace hulld {

// WatchCollisions, message by message: tells when pairs begin and end to collide. A watch whose
// connection is lost goes on where it was: it opens another call with the poses as they are by now,
// tells what changed meanwhile and nothing twice, and ends that as `synced` once more. So code that
// folds the events needs to know nothing of connections. Next is for one thread, Update for one,
// which may be another, and Cancel for any.
class CollisionWatch {
 public:
  // Connects in Next. patience: for how long to look for a server that was there before; the first
  // call, and one that the server refuses, fail as `retry` says.
  CollisionWatch(std::shared_ptr<v1::CollisionService::Stub> stub, v1::CollisionWatchOpen open,
                 RetryPolicy retry, std::chrono::milliseconds patience);
  // Cancels the watch.
  ~CollisionWatch();
  CollisionWatch(const CollisionWatch&) = delete;
  CollisionWatch& operator=(const CollisionWatch&) = delete;

  // Waits for the next message. An error ends the watch: CANCELLED after Cancel, and those of the
  // contract.
  absl::StatusOr<v1::WatchCollisionsResponse> Next();

  // Says where placements are now. While there is no connection it is noted, for the next.
  // INVALID_ARGUMENT, without saying anything: it names a placement that does not exist, or does
  // not have seven numbers for each.
  absl::Status Update(const v1::CollisionWatchUpdate& update);

  // Has Next return, now and ever after.
  void Cancel();

 private:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<
        grpc::ClientReaderWriter<v1::WatchCollisionsRequest, v1::WatchCollisionsResponse>>
        stream;
    // The updates that its `open` takes into account.
    uint64_t updates_before = 0;
  };

  // Null once Cancel was called.
  std::shared_ptr<Call> Open();
  absl::Status Close(Call& call);

  const std::shared_ptr<v1::CollisionService::Stub> stub_;
  const RetryPolicy retry_;
  const std::chrono::milliseconds patience_;

  // Used by Next alone.
  ToldPairs told_;
  std::shared_ptr<Call> call_;
  // A message came, hence there is a server, which was told of pairs.
  bool connected_ = false;

  // Before the other where both are held. Guards what placements are where, how many updates said
  // so, and which call they go to, and that a call begins with `open`.
  std::mutex update_mutex_;
  v1::CollisionWatchOpen open_;
  uint64_t updates_ = 0;
  std::shared_ptr<Call> updated_call_;

  // Guards the call that Cancel ends.
  std::mutex cancel_mutex_;
  std::shared_ptr<Call> cancelled_call_;
  bool cancelled_ = false;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_COLLISION_WATCH_H_
