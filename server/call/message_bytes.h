#ifndef HULLD_SERVER_CALL_MESSAGE_BYTES_H_
#define HULLD_SERVER_CALL_MESSAGE_BYTES_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/byte_buffer.h>

#include "server/call/request_memory.h"

namespace hulld::server {

// Serialized messages, as gRPC transports them. Calls exchange bytes instead of messages, because
// gRPC would parse a request before authentication and without a limit.

using Bytes = grpc::ByteBuffer;
using CallContext = grpc::CallbackServerContext;
using UnaryReactor = grpc::ServerUnaryReactor;
using ReadReactor = grpc::ServerReadReactor<Bytes>;
using WriteReactor = grpc::ServerWriteReactor<Bytes>;
using BidiReactor = grpc::ServerBidiReactor<Bytes, Bytes>;

// Parses a request of an admitted caller and frees its bytes. `share` then covers the message and
// must live as long. INVALID_ARGUMENT: the bytes are not a message of this type.
// RESOURCE_EXHAUSTED: see RequestMemory::Take; the message is then not parsed.
absl::Status ParseRequest(Bytes& bytes, RequestMemory& memory, google::protobuf::Message* message,
                          RequestMemory::Share& share);

// Moves the bytes out of a request that gRPC passes as const but no longer needs.
inline Bytes StealBytes(const Bytes& bytes) {
  Bytes taken;
  taken.Swap(const_cast<Bytes*>(&bytes));
  return taken;
}

Bytes SerializeReply(const google::protobuf::Message& message);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_MESSAGE_BYTES_H_
