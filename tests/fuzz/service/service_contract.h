#ifndef HULLD_TESTS_FUZZ_SERVICE_SERVICE_CONTRACT_H_
#define HULLD_TESTS_FUZZ_SERVICE_SERVICE_CONTRACT_H_

#include <grpcpp/support/status.h>

#include <string>

#include "server/contract/rpc.h"

namespace hulld::fuzz {

// The client's treatment of a call.
struct CallManner {
  // Its deadline had passed or nearly passed.
  bool hurried = false;
  bool cancelled = false;
  // It sent raw bytes, possibly malformed.
  bool raw = false;
};

// Returns how the status of a call violates the API contract; empty if it does not.
std::string CheckStatus(server::Rpc rpc, const CallManner& manner, const grpc::Status& status);

// Returns the name of a code, e.g. "NOT_FOUND".
std::string CodeName(grpc::StatusCode code);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_SERVICE_CONTRACT_H_
