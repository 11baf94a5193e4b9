#ifndef HULLD_SERVER_CALL_TRANSPORT_H_
#define HULLD_SERVER_CALL_TRANSPORT_H_

#include <grpcpp/server_builder.h>

#include "server/settings/config.h"

namespace hulld::server {

// How bytes move between gRPC and us, whatever they mean: sizes of messages, sharing of ports. The
// floor that tests/bench compares with is set up by it too.
void SetTransport(const Config& config, grpc::ServerBuilder& builder);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_TRANSPORT_H_
