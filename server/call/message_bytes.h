#ifndef HULLD_SERVER_CALL_MESSAGE_BYTES_H_
#define HULLD_SERVER_CALL_MESSAGE_BYTES_H_

#include <absl/status/status.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include "server/call/request_memory.h"

namespace hulld::server {

// Messages as gRPC carries them. Every call takes and gives bytes, not messages: gRPC would parse a
// request before anyone can ask who calls, and without any limit.

// Parses a request of a caller that was let in, and frees its bytes. `share` covers the message
// from then on: keep it as long as the message. INVALID_ARGUMENT: the bytes are no such message.
// RESOURCE_EXHAUSTED: as RequestMemory::Take; the message is not parsed then.
absl::Status ParseRequest(grpc::ByteBuffer& bytes, RequestMemory& memory,
                          google::protobuf::Message* message, RequestMemory::Share& share);

// The bytes of a request that gRPC hands out as const and has no more use for.
inline grpc::ByteBuffer TakenFrom(const grpc::ByteBuffer& bytes) {
  grpc::ByteBuffer taken;
  taken.Swap(const_cast<grpc::ByteBuffer*>(&bytes));
  return taken;
}

grpc::ByteBuffer SerializeReply(const google::protobuf::Message& message);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_MESSAGE_BYTES_H_
