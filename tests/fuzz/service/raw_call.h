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

// A call whose messages are bytes.
struct RawCall {
  server::Rpc rpc = server::Rpc::kGetStatus;
  std::vector<std::string> messages;
  // Whether the first message cannot be read.
  bool malformed = false;
};

// Noise, messages cut short or with bytes changed, strings that are not UTF-8, groups nested
// deeper than protobuf reads, messages of more bytes than the server takes, or none at all.
RawCall DecodeRawCall(ByteReader& in, const MessageHints& hints);

// Whether such a call has no end of its own.
bool LastsUntilCancelled(server::Rpc rpc);

// Sends them, reads whatever comes, and returns how the call ended. One that has no end of its own
// is cancelled after its first reply.
grpc::Status MakeRawCall(grpc::GenericStub& stub, grpc::ClientContext& context,
                         const RawCall& call);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_RAW_CALL_H_
