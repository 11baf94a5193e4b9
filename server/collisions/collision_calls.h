#ifndef HULLD_SERVER_COLLISIONS_COLLISION_CALLS_H_
#define HULLD_SERVER_COLLISIONS_COLLISION_CALLS_H_

#include "server/call/message_bytes.h"
#include "server/call/service_parts.h"

// The calls of CollisionService. Each function starts a call and returns its reactor, which owns
// itself until gRPC releases it. request, response: owned by gRPC until the call ends.
namespace hulld::server {

UnaryReactor* StartCheck(CallContext& context, const ServiceParts& parts, const Bytes& request,
                         Bytes* response);
WriteReactor* StartBatch(CallContext& context, const ServiceParts& parts, const Bytes& request);
WriteReactor* StartScene(CallContext& context, const ServiceParts& parts, const Bytes& request);
BidiReactor* StartCollisionStream(CallContext& context, const ServiceParts& parts);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_COLLISION_CALLS_H_
