#include "client/watch/collision_watch.h"

#include <utility>

#include "client/calls/grpc_status.h"

namespace hulld {

CollisionWatch::CollisionWatch(std::shared_ptr<v1::CollisionService::Stub> stub,
                               v1::CollisionWatchOpen open)
    : stub_(std::move(stub)), stream_(stub_->WatchCollisions(&context_)) {
  v1::WatchCollisionsRequest request;
  *request.mutable_open() = std::move(open);
  // Where this fails, Next says why.
  stream_->Write(request);
}

CollisionWatch::~CollisionWatch() {
  if (!end_.ok()) return;
  Cancel();
  v1::WatchCollisionsResponse rest;
  while (stream_->Read(&rest)) {
  }
  stream_->Finish();
}

absl::StatusOr<v1::WatchCollisionsResponse> CollisionWatch::Next() {
  if (!end_.ok()) return end_;
  v1::WatchCollisionsResponse message;
  if (stream_->Read(&message)) return message;
  end_ = FromGrpcStatus(stream_->Finish(), context_);
  // The client never says that it has said all.
  if (end_.ok()) end_ = absl::InternalError("the server ended the watch without a cause");
  return end_;
}

bool CollisionWatch::Update(const v1::CollisionWatchUpdate& update) {
  v1::WatchCollisionsRequest request;
  *request.mutable_update() = update;
  return stream_->Write(request);
}

}  // namespace hulld
