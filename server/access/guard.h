#ifndef HULLD_SERVER_ACCESS_GUARD_H_
#define HULLD_SERVER_ACCESS_GUARD_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "server/access/authenticator.h"
#include "server/access/tls_credentials.h"
#include "server/settings/config.h"

namespace hulld::server {

// Decides who may connect and who may call, as the files of --tls-cert, --tls-key, --tls-client-ca
// and --tokens-file say. It looks at the files every Config::kReloadInterval. New files that are
// valid hold for connections and calls from then on, and calls that run on tokens that are gone are
// ended. Files that are broken are reported and change nothing.
class Guard {
 public:
  // INVALID_ARGUMENT names the setting whose file is wrong.
  static absl::StatusOr<std::unique_ptr<Guard>> Load(const Config& config);

  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;
  ~Guard();

  const Authenticator& authenticator() const { return authenticator_; }
  // For the listening port: TLS, or none.
  std::shared_ptr<grpc::ServerCredentials> credentials() const;

  // Looks at the files now. Any thread.
  void Reload();

  // Called whenever other tokens are in force, on the thread that noticed; null: no longer. Once
  // this returns, the one before is not running.
  void OnTokensChanged(std::function<void()> changed);

 private:
  explicit Guard(const Config& config) : config_(config) {}

  absl::Status LoadAll();
  // The following require the mutex.
  absl::Status ReloadTls();
  absl::Status ReloadTokens();
  void Watch();

  const Config config_;
  Authenticator authenticator_;
  // Null without TLS.
  std::shared_ptr<TlsCredentials> tls_;

  std::mutex mutex_;
  // What is in force, and what was last complained about. Guarded by the mutex.
  TlsIdentity identity_;
  TokenTable tokens_;
  std::string tls_complaint_;
  std::string tokens_complaint_;

  std::function<void()> tokens_changed_;

  bool ending_ = false;
  std::condition_variable end_;
  std::thread watcher_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_GUARD_H_
