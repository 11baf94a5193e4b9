#ifndef HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <memory>

#include "server/call/message_bytes.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.CollisionService: implements the contract in collision.proto with the queries of core. A
// single pair is answered on arrival, on gRPC's thread, if only its relation is wanted and its
// hulls are ready and of moderate size (pair_query.cc). Everything else runs on `pool`: single
// pairs and short steps of streams before slices of batches, scenes, and long steps. Work that may
// wait for the store, or that builds canonical snapshots, runs on `readers` (for the hulls of one
// pair) or `long_readers` (for many hulls). TEXTBOOK_SAT pairs are answered in slices that
// alternate with other calls. The parts must outlive the service.
std::unique_ptr<grpc::Service> MakeCollisionService(const ServiceParts& parts);

// The calls of the service. Each function starts a call and returns its reactor, which owns itself
// until gRPC releases it. request, response: owned by gRPC until the call ends.
UnaryReactor* StartCheck(CallContext& context, const ServiceParts& parts, const Bytes& request,
                         Bytes* response);
WriteReactor* StartBatch(CallContext& context, const ServiceParts& parts, const Bytes& request);
WriteReactor* StartScene(CallContext& context, const ServiceParts& parts, const Bytes& request);
BidiReactor* StartCollisionStream(CallContext& context, const ServiceParts& parts);
BidiReactor* StartCollisionWatch(CallContext& context, const ServiceParts& parts);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_SERVICE_H_
