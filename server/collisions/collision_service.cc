#include "server/collisions/collision_service.h"

#include <memory>

#include "server/collisions/batch_stream.h"
#include "server/collisions/collision_stream.h"
#include "server/collisions/pair_question.h"
#include "server/collisions/scene_stream.h"
#include "server/collisions/watch/collision_watch.h"

namespace hulld::server {

UnaryReactor* CollisionService::CheckCollision(CallContext* context, const Bytes* request,
                                               Bytes* response) {
  return CheckCall::Start(context, parts_.admission, Rpc::kCheckCollision, request, response,
                          [this](CheckCall* call) { PairQuestion::Start(parts_, call); });
}

WriteReactor* CollisionService::BatchCheckCollisions(CallContext* context, const Bytes* request) {
  return BatchStream::Launch(std::make_shared<BatchStream>(*context, parts_, *request));
}

BidiReactor* CollisionService::StreamCollisions(CallContext* context) {
  return CollisionStream::Launch(std::make_shared<CollisionStream>(*context, parts_));
}

WriteReactor* CollisionService::FindCollisions(CallContext* context, const Bytes* request) {
  return SceneStream::Launch(std::make_shared<SceneStream>(*context, parts_, *request));
}

BidiReactor* CollisionService::WatchCollisions(CallContext* context) {
  return CollisionWatch::Launch(std::make_shared<CollisionWatch>(*context, parts_));
}

}  // namespace hulld::server
