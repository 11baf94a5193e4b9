#ifndef HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <cstddef>

#include "hulld/v1/collision.grpc.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// The generated service, with methods that exchange bytes (message_bytes.h).
using CollisionServiceOfBytes = v1::CollisionService::WithRawCallbackMethod_CheckCollision<
    v1::CollisionService::WithRawCallbackMethod_BatchCheckCollisions<
        v1::CollisionService::WithRawCallbackMethod_StreamCollisions<
            v1::CollisionService::WithRawCallbackMethod_FindCollisions<
                v1::CollisionService::WithRawCallbackMethod_WatchCollisions<
                    v1::CollisionService::Service>>>>>;

// hulld.v1.CollisionService: implements the contract in collision.proto with the queries of core. A
// single pair is answered on arrival, on gRPC's thread, if only its relation is wanted and its
// hulls are ready and of moderate size (PairQuestion). Everything else runs on `pool`: single pairs
// and short steps of streams before slices of batches, scenes, and long steps. Work that may wait
// for the store, or that builds canonical snapshots, runs on `readers` (for the hulls of one pair)
// or `long_readers` (for many hulls). TEXTBOOK_SAT pairs are answered in slices that alternate with
// other calls.
class CollisionService : public CollisionServiceOfBytes {
 public:
  explicit CollisionService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* CheckCollision(CallContext* context, const Bytes* request,
                               Bytes* response) override;
  WriteReactor* BatchCheckCollisions(CallContext* context, const Bytes* request) override;
  BidiReactor* StreamCollisions(CallContext* context) override;
  WriteReactor* FindCollisions(CallContext* context, const Bytes* request) override;
  BidiReactor* WatchCollisions(CallContext* context) override;

 private:
  const ServiceParts& parts_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
