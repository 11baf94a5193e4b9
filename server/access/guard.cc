#include "server/access/guard.h"

#include <absl/status/status.h>
#include <absl/strings/match.h>
#include <spdlog/spdlog.h>

#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

constexpr char kKey[] = "authorization";
constexpr char kScheme[] = "Bearer ";

absl::Status Missing(const char* message) {
  return WithReason(absl::UnauthenticatedError(message), v1::ERROR_REASON_TOKEN_MISSING);
}

// Logs each new error of a file, and its recovery, once.
void LogNewError(const char* what, const absl::Status& status, std::string* last_error) {
  const std::string message(status.message());
  if (message == *last_error) return;
  *last_error = message;
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
    guard->reloads_.emplace(Config::kReloadInterval, [guard = guard.get()] { guard->Reload(); });
  }
  return guard;
}

absl::StatusOr<Caller> Guard::Authenticate(
    const std::multimap<grpc::string_ref, grpc::string_ref>& metadata, Rpc rpc) const {
  const std::shared_ptr<const TokenTable> tokens = tokens_.load();
  if (tokens == nullptr) return Caller();
  const auto [first, last] = metadata.equal_range(kKey);
  if (first == last) {
    return Missing("the call has no token; send one as metadata \"authorization: Bearer TOKEN\"");
  }
  if (std::next(first) != last) {
    return Missing("the call has \"authorization\" twice; send one");
  }
  const std::string value(first->second.data(), first->second.size());
  if (!absl::StartsWithIgnoreCase(value, kScheme)) {
    return Missing("the metadata \"authorization\" must have the form \"Bearer TOKEN\"");
  }
  const std::optional<Caller> caller = tokens->Find(value.substr(sizeof kScheme - 1));
  if (!caller.has_value()) {
    return WithReason(absl::UnauthenticatedError("the call's token is unknown or no longer valid; "
                                                 "ask the server's operator for a new one"),
                      v1::ERROR_REASON_TOKEN_UNKNOWN);
  }
  HULLD_RETURN_IF_ERROR(CheckPermission(*caller, rpc));
  return *caller;
}

bool Guard::Knows(const Caller& caller) const {
  const std::shared_ptr<const TokenTable> tokens = tokens_.load();
  return tokens == nullptr || tokens->Knows(caller);
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
  if (config_.has_tls()) LogNewError("the TLS certificates", ReloadTls(), &tls_error_);
  if (!config_.tokens_file.empty()) LogNewError("the tokens", ReloadTokens(), &tokens_error_);
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
  spdlog::info("using the TLS certificate of {}, valid until {}", identity_.subject,
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
  const std::shared_ptr<const TokenTable> before = tokens_.load();
  HULLD_ASSIGN_OR_RETURN(TokenTable table, ReadTokensFile(config_.tokens_file, before != nullptr));
  if (before != nullptr && table == *before) return absl::OkStatus();
  const auto tokens = std::make_shared<const TokenTable>(std::move(table));
  tokens_.store(tokens);
  if (tokens->empty()) {
    spdlog::error(
        "--tokens-file {} is missing or contains no token: all tokens are revoked and all calls "
        "are refused; add a token with 'hullctl token new'",
        config_.tokens_file);
  } else {
    spdlog::info("loaded {} token{}", tokens->size(), tokens->size() == 1 ? "" : "s");
  }
  if (tokens_changed_) tokens_changed_();
  return absl::OkStatus();
}

}  // namespace hulld::server
