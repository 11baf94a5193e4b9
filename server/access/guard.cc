#include "server/access/guard.h"

#include <absl/status/status.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "core/base/status_macros.h"
#include "server/access/token_table.h"

namespace hulld::server {
namespace {

// Logs each new error of a file, and its recovery, once.
void Complain(const char* what, const absl::Status& status, std::string* complaint) {
  const std::string message(status.message());
  if (message == *complaint) return;
  *complaint = message;
  if (status.ok()) {
    spdlog::info("{} are readable again", what);
  } else {
    spdlog::error("{} were not reloaded: {}", what, message);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<Guard>> Guard::Load(const Config& config) {
  std::unique_ptr<Guard> guard(new Guard(config));
  HULLD_RETURN_IF_ERROR(guard->LoadAll());
  if (config.has_tls() || !config.tokens_file.empty()) {
    guard->watcher_ = std::thread([guard = guard.get()] { guard->Watch(); });
  }
  return guard;
}

Guard::~Guard() {
  if (!watcher_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_all();
  watcher_.join();
}

std::shared_ptr<grpc::ServerCredentials> Guard::credentials() const {
  if (tls_ != nullptr) return tls_;
  return grpc::InsecureServerCredentials();
}

absl::Status Guard::LoadAll() {
  const std::lock_guard lock(mutex_);
  if (config_.has_tls()) {
    HULLD_RETURN_IF_ERROR(ReloadTls());
  }
  if (!config_.tokens_file.empty()) return ReloadTokens();
  return absl::OkStatus();
}

void Guard::Reload() {
  const std::lock_guard lock(mutex_);
  if (config_.has_tls()) Complain("the TLS certificates", ReloadTls(), &tls_complaint_);
  if (!config_.tokens_file.empty()) Complain("the tokens", ReloadTokens(), &tokens_complaint_);
}

void Guard::OnTokensChanged(std::function<void()> changed) {
  const std::lock_guard lock(mutex_);
  tokens_changed_ = std::move(changed);
}

absl::Status Guard::ReloadTls() {
  absl::StatusOr<TlsIdentity> loaded = LoadTlsIdentity(config_);
  if (!loaded.ok() && tls_ != nullptr && HasLostAuthorities(config_)) {
    RevokeAuthorities();
    return absl::OkStatus();
  }
  if (!loaded.ok()) return loaded.status();
  if (*loaded == identity_) return absl::OkStatus();
  identity_ = *loaded;
  if (tls_ == nullptr) {
    tls_ = std::make_shared<TlsCredentials>(*std::move(loaded));
  } else {
    tls_->SetIdentity(*std::move(loaded));
  }
  spdlog::info("TLS certificate of {} in force, valid until {}", identity_.subject,
               FormatTime(identity_.not_after));
  const absl::Status valid = CheckValidity(identity_, std::chrono::system_clock::now());
  if (!valid.ok()) spdlog::warn("{}", std::string(valid.message()));
  return absl::OkStatus();
}

void Guard::RevokeAuthorities() {
  TlsIdentity alone = identity_;
  alone.client_authorities = FirstCertificate(identity_.certificates);
  if (alone == identity_) return;
  identity_ = alone;
  tls_->SetIdentity(std::move(alone));
  spdlog::error(
      "--tls-client-ca {} is missing or contains no certificate: no client can connect; restore "
      "the file",
      config_.tls_client_ca);
}

absl::Status Guard::ReloadTokens() {
  const bool is_first = authenticator_.generation() == 0;
  HULLD_ASSIGN_OR_RETURN(TokenTable table, ReadTokensFile(config_.tokens_file, !is_first));
  if (table == tokens_) return absl::OkStatus();
  tokens_ = std::move(table);
  authenticator_.SetTokens(tokens_);
  if (tokens_.empty()) {
    spdlog::error(
        "--tokens-file {} is missing or contains no token: all tokens are revoked and all calls "
        "are refused; add a token with 'hullctl token new'",
        config_.tokens_file);
  } else {
    spdlog::info("{} token{} in force", tokens_.size(), tokens_.size() == 1 ? "" : "s");
  }
  if (tokens_changed_) tokens_changed_();
  return absl::OkStatus();
}

void Guard::Watch() {
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, Config::kReloadInterval, [this] { return ending_; })) {
    lock.unlock();
    Reload();
    lock.lock();
  }
}

}  // namespace hulld::server
