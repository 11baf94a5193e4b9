#ifndef HULLD_TESTS_SERVER_HARNESS_TEST_TOKENS_H_
#define HULLD_TESTS_SERVER_HARNESS_TEST_TOKENS_H_

#include <grpcpp/grpcpp.h>

#include <string>

namespace hulld::server {

// Returns a line of --tokens-file. role: read-only, read-write, or admin. prefix: "*" for all.
std::string TokenLine(const std::string& name, const std::string& role, const std::string& prefix,
                      const std::string& token);

// Authenticates a call with this token.
void Authorize(grpc::ClientContext& context, const std::string& token);

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_TEST_TOKENS_H_
