#ifndef HULLD_CLIENT_WATCH_COLLISION_WATCH_H_
#define HULLD_CLIENT_WATCH_COLLISION_WATCH_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <memory>

#include "hulld/v1/collision.grpc.pb.h"

namespace hulld {

// One WatchCollisions call: tells when pairs begin and end to collide. Next is for one thread,
// Update for one, which may be another, and Cancel for any. Never retried: what the server keeps of
// a watch ends with it.
class CollisionWatch {
 public:
  CollisionWatch(std::shared_ptr<v1::CollisionService::Stub> stub, v1::CollisionWatchOpen open);
  // Cancels the watch.
  ~CollisionWatch();
  CollisionWatch(const CollisionWatch&) = delete;
  CollisionWatch& operator=(const CollisionWatch&) = delete;

  // Waits for the next message. An error ends the watch, and every later call returns it.
  absl::StatusOr<v1::WatchCollisionsResponse> Next();

  // Says where placements are now. False when the watch has ended; Next says why.
  bool Update(const v1::CollisionWatchUpdate& update);

  // Has Next return CANCELLED.
  void Cancel() { context_.TryCancel(); }

 private:
  const std::shared_ptr<v1::CollisionService::Stub> stub_;
  grpc::ClientContext context_;
  const std::unique_ptr<
      grpc::ClientReaderWriter<v1::WatchCollisionsRequest, v1::WatchCollisionsResponse>>
      stream_;
  // OK while it lasts.
  absl::Status end_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_COLLISION_WATCH_H_
