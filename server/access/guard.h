#ifndef HULLD_SERVER_ACCESS_GUARD_H_
#define HULLD_SERVER_ACCESS_GUARD_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/access/caller.h"
#include "server/access/tls.h"
#include "server/access/token_table.h"
#include "server/process/periodic_task.h"
#include "server/settings/config.h"

namespace hulld::server {

// Controls access by the files of --tls-cert, --tls-key, --tls-client-ca, and --tokens-file. Checks
// the files every Config::kReloadInterval. Valid new files apply to later connections and calls,
// and running calls with revoked tokens end. Invalid files are logged and change nothing. A file of
// tokens or of clients' authorities that is missing or empty revokes all of them.
class Guard {
 public:
  // INVALID_ARGUMENT names the setting with an invalid file.
  static absl::StatusOr<std::unique_ptr<Guard>> Load(const Config& config);

  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

  // Returns the caller, identified by "authorization: Bearer TOKEN" in the metadata of a call.
  // Without --tokens-file, every caller has all rights. UNAUTHENTICATED: the token is missing or
  // unknown; the message never repeats it. PERMISSION_DENIED: the token's role does not allow the
  // call. Thread-safe.
  absl::StatusOr<Caller> Authenticate(
      const std::multimap<grpc::string_ref, grpc::string_ref>& metadata, Rpc rpc) const;
  // Returns true if the token of an authenticated caller is still valid, with the same rights.
  // Thread-safe.
  bool Knows(const Caller& caller) const;

  // Credentials for the listening port: TLS, or none.
  std::shared_ptr<grpc::ServerCredentials> credentials() const;

  // Checks the files now. Thread-safe.
  void Reload();

  // Sets the callback that runs after each change of the tokens, on the thread that detected it;
  // null: none. Blocks until the previous callback has returned.
  void OnTokensChanged(std::function<void()> changed);

 private:
  explicit Guard(const Config& config) : config_(config) {}

  absl::Status LoadAll();
  // The following require mutex_.
  absl::Status ReloadTls();
  // Refuses all further connections.
  void RevokeAuthorities();
  absl::Status ReloadTokens();

  const Config config_;
  // Null without TLS.
  std::shared_ptr<TlsCredentials> tls_;
  // Null: calls need no token.
  std::atomic<std::shared_ptr<const TokenTable>> tokens_;

  // Held while files are read; guards the members below.
  std::mutex mutex_;
  // The current TLS identity, and the last logged error of each kind of file.
  TlsIdentity identity_;
  std::string tls_error_;
  std::string tokens_error_;

  std::function<void()> tokens_changed_;

  // Last member, because it uses the others.
  std::optional<PeriodicTask> reloads_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_GUARD_H_
