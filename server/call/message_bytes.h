#ifndef HULLD_SERVER_CALL_MESSAGE_BYTES_H_
#define HULLD_SERVER_CALL_MESSAGE_BYTES_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include "server/call/request_memory.h"

namespace hulld::server {

// Messages as gRPC carries them. Calls exchange bytes instead of messages, because gRPC would parse
// a request before authentication and without a limit.

// Parses a request of an admitted caller and frees its bytes. `share` then covers the message and
// must live as long. INVALID_ARGUMENT: the bytes are not such a message. RESOURCE_EXHAUSTED: as
// RequestMemory::Take; the message is not parsed then.
absl::Status ParseRequest(grpc::ByteBuffer& bytes, RequestMemory& memory,
                          google::protobuf::Message* message, RequestMemory::Share& share);

// Moves out the bytes of a request that gRPC passes as const but no longer needs.
inline grpc::ByteBuffer TakenFrom(const grpc::ByteBuffer& bytes) {
  grpc::ByteBuffer taken;
  taken.Swap(const_cast<grpc::ByteBuffer*>(&bytes));
  return taken;
}

grpc::ByteBuffer SerializeReply(const google::protobuf::Message& message);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_MESSAGE_BYTES_H_
