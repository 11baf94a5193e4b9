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

// Tells who calls, by "authorization: Bearer TOKEN" in the call's metadata. Without tokens everyone
// may do everything. Any thread.
class Authenticator {
 public:
  using Metadata = std::multimap<grpc::string_ref, grpc::string_ref>;

  // UNAUTHENTICATED: no token, or none that is known; the message never repeats it.
  // PERMISSION_DENIED: the token's role does not allow the call.
  absl::StatusOr<Caller> Authenticate(const Metadata& metadata, Rpc rpc) const;

  // From now on callers need one of these tokens. Calls that run are for others to end (Knows).
  void SetTokens(TokenTable tokens);

  // Whether the token of a caller that was let in is still valid, with the rights that it had.
  bool Knows(const Caller& caller) const;
  // How often the tokens changed. What was found out about a caller holds as long as this stays the
  // same.
  uint64_t generation() const { return generation_.load(std::memory_order_acquire); }

 private:
  std::shared_ptr<const TokenTable> tokens() const;

  mutable std::mutex mutex_;
  // Null: no tokens are needed. Guarded by the mutex.
  std::shared_ptr<const TokenTable> tokens_;
  std::atomic<uint64_t> generation_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_AUTHENTICATOR_H_
