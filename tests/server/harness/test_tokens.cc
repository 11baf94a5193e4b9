#include "tests/server/harness/test_tokens.h"

#include <openssl/sha.h>

#include <cstdio>

namespace hulld::server {

std::string TokenLine(const std::string& name, const std::string& role, const std::string& prefix,
                      const std::string& token) {
  unsigned char hash[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash);
  std::string text = name + " " + role + " " + prefix + " sha256:";
  for (const unsigned char byte : hash) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", byte);
    text += digits;
  }
  return text + "\n";
}

void Authorize(grpc::ClientContext& context, const std::string& token) {
  context.AddMetadata("authorization", "Bearer " + token);
}

}  // namespace hulld::server
