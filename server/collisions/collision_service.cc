#include "server/collisions/collision_service.h"

#include "hulld/v1/collision.grpc.pb.h"

namespace hulld::server {
namespace {

// The generated service, with methods that exchange bytes (message_bytes.h).
using CollisionServiceOfBytes = v1::CollisionService::WithRawCallbackMethod_CheckCollision<
    v1::CollisionService::WithRawCallbackMethod_BatchCheckCollisions<
        v1::CollisionService::WithRawCallbackMethod_StreamCollisions<
            v1::CollisionService::WithRawCallbackMethod_FindCollisions<
                v1::CollisionService::WithRawCallbackMethod_WatchCollisions<
                    v1::CollisionService::Service>>>>>;

class CollisionService : public CollisionServiceOfBytes {
 public:
  explicit CollisionService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* CheckCollision(CallContext* context, const Bytes* request,
                               Bytes* response) override {
    return StartCheck(*context, parts_, *request, response);
  }

  WriteReactor* BatchCheckCollisions(CallContext* context, const Bytes* request) override {
    return StartBatch(*context, parts_, *request);
  }

  BidiReactor* StreamCollisions(CallContext* context) override {
    return StartCollisionStream(*context, parts_);
  }

  WriteReactor* FindCollisions(CallContext* context, const Bytes* request) override {
    return StartScene(*context, parts_, *request);
  }

  BidiReactor* WatchCollisions(CallContext* context) override {
    return StartCollisionWatch(*context, parts_);
  }

 private:
  const ServiceParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeCollisionService(const ServiceParts& parts) {
  return std::make_unique<CollisionService>(parts);
}

}  // namespace hulld::server
