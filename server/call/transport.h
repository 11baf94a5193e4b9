#ifndef HULLD_SERVER_CALL_TRANSPORT_H_
#define HULLD_SERVER_CALL_TRANSPORT_H_

#include <grpcpp/server_builder.h>

#include "server/settings/config.h"

namespace hulld::server {

// Configures gRPC's transport: message sizes, port sharing, compression. The baseline server of
// tests/bench uses it too.
void SetTransport(const Config& config, grpc::ServerBuilder& builder);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_TRANSPORT_H_
