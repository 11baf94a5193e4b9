#ifndef HULLD_SERVER_COLLISIONS_WATCH_COLLISION_WATCH_H_
#define HULLD_SERVER_COLLISIONS_WATCH_COLLISION_WATCH_H_

#include "server/call/message_bytes.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// Starts a WatchCollisions call and returns its reactor, which owns itself until gRPC releases it.
BidiReactor* StartCollisionWatch(CallContext& context, const ServiceParts& parts);

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCH_COLLISION_WATCH_H_
