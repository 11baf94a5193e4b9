#ifndef HULLD_SERVER_HULLS_HULL_STREAMS_H_
#define HULLD_SERVER_HULLS_HULL_STREAMS_H_

#include "server/call/message_bytes.h"
#include "server/call/service_parts.h"

// The streaming calls of HullService. Each function starts a call and returns its reactor, which
// owns itself until gRPC releases it. request, response: owned by gRPC until the call ends.
namespace hulld::server {

BidiReactor* StartAppend(CallContext& context, const ServiceParts& parts);
ReadReactor* StartReplace(CallContext& context, const ServiceParts& parts, Bytes* response);
WriteReactor* StartMesh(CallContext& context, const ServiceParts& parts, const Bytes& request);
WriteReactor* StartWatch(CallContext& context, const ServiceParts& parts, const Bytes& request);

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_HULL_STREAMS_H_
