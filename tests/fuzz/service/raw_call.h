#ifndef HULLD_TESTS_FUZZ_SERVICE_RAW_CALL_H_
#define HULLD_TESTS_FUZZ_SERVICE_RAW_CALL_H_

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <string>
#include <vector>

#include "server/contract/rpc.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/service/fuzz_message.h"

namespace hulld::fuzz {

// A call with raw bytes as messages.
struct RawCall {
  server::Rpc rpc = server::Rpc::kGetStatus;
  std::vector<std::string> messages;
  // True if the first message is malformed.
  bool malformed = false;
};

// Generates noise, truncated or altered messages, strings that are not UTF-8, groups nested deeper
// than protobuf allows, messages that exceed the server's limit, or none at all.
RawCall DecodeRawCall(ByteReader& in, const MessageHints& hints);

// Returns true if such a call does not end by itself.
bool LastsUntilCancelled(server::Rpc rpc);

// Sends the messages, reads all replies, and returns the final status. A call that does not end by
// itself is cancelled after its first reply.
grpc::Status MakeRawCall(grpc::GenericStub& stub, grpc::ClientContext& context,
                         const RawCall& call);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_RAW_CALL_H_
