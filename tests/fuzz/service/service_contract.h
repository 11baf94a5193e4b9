#ifndef HULLD_TESTS_FUZZ_SERVICE_SERVICE_CONTRACT_H_
#define HULLD_TESTS_FUZZ_SERVICE_SERVICE_CONTRACT_H_

#include <grpcpp/support/status.h>

#include <string>

#include "server/contract/rpc.h"

namespace hulld::fuzz {

// How a client treated its own call.
struct CallManner {
  // Its deadline had passed, or nearly.
  bool hurried = false;
  bool cancelled = false;
  // It sent bytes that need not be a message.
  bool raw = false;
};

// What is wrong with how a call ended by the comments of the contract, or nothing.
std::string CheckStatus(server::Rpc rpc, const CallManner& manner, const grpc::Status& status);

// "NOT_FOUND".
std::string CodeName(grpc::StatusCode code);

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_SERVICE_SERVICE_CONTRACT_H_
