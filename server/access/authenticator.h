#ifndef HULLD_SERVER_ACCESS_AUTHENTICATOR_H_
#define HULLD_SERVER_ACCESS_AUTHENTICATOR_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

#include "server/access/caller.h"
#include "server/access/token_table.h"

namespace hulld::server {

// Identifies the caller by "authorization: Bearer TOKEN" in the metadata of a call. Without tokens,
// every caller has all rights. Thread-safe.
class Authenticator {
 public:
  using Metadata = std::multimap<grpc::string_ref, grpc::string_ref>;

  // Returns the caller. UNAUTHENTICATED: the token is missing or unknown; the message never repeats
  // it. PERMISSION_DENIED: the token's role does not allow the call.
  absl::StatusOr<Caller> Authenticate(const Metadata& metadata, Rpc rpc) const;

  // Replaces the accepted tokens. Does not end running calls (see Knows).
  void SetTokens(TokenTable tokens);

  // Returns true if the token of an authenticated caller is still valid, with the same rights.
  bool Knows(const Caller& caller) const;
  // Number of changes of the tokens. Results of Authenticate stay valid while it is unchanged.
  uint64_t generation() const { return generation_.load(std::memory_order_acquire); }

 private:
  std::shared_ptr<const TokenTable> tokens() const;

  mutable std::mutex mutex_;
  // Null: calls need no token. Guarded by mutex_.
  std::shared_ptr<const TokenTable> tokens_;
  std::atomic<uint64_t> generation_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_AUTHENTICATOR_H_
