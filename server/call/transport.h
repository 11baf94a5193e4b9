#ifndef HULLD_SERVER_CALL_TRANSPORT_H_
#define HULLD_SERVER_CALL_TRANSPORT_H_

#include <grpcpp/server_builder.h>

#include <cstdint>

#include "server/settings/config.h"

namespace hulld::server {

// Maximum total size of messages that gRPC may be receiving at the start of calls: a few of maximum
// size.
uint64_t MaxHalfOpenBytes(const Config& config);

// Configures gRPC's transport: message sizes, port sharing, compression. The baseline server of
// tests/bench uses it too.
void SetTransport(const Config& config, grpc::ServerBuilder& builder);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_TRANSPORT_H_
