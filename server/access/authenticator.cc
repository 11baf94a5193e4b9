#include "server/access/authenticator.h"

#include <absl/status/status.h>
#include <absl/strings/match.h>

#include <optional>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/contract/error_info.h"

namespace hulld::server {
namespace {

constexpr char kKey[] = "authorization";
constexpr char kScheme[] = "Bearer ";

absl::Status Missing(const char* message) {
  return WithReason(absl::UnauthenticatedError(message), v1::ERROR_REASON_TOKEN_MISSING);
}

}  // namespace

std::shared_ptr<const TokenTable> Authenticator::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

void Authenticator::SetTokens(TokenTable tokens) {
  auto table = std::make_shared<const TokenTable>(std::move(tokens));
  const std::lock_guard lock(mutex_);
  tokens_ = std::move(table);
  generation_.fetch_add(1, std::memory_order_release);
}

bool Authenticator::Knows(const Caller& caller) const {
  const std::shared_ptr<const TokenTable> table = tokens();
  return table == nullptr || table->Knows(caller);
}

absl::StatusOr<Caller> Authenticator::Authenticate(const Metadata& metadata, Rpc rpc) const {
  const std::shared_ptr<const TokenTable> table = tokens();
  if (table == nullptr) return Caller();
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
  const std::optional<Caller> caller = table->Find(value.substr(sizeof kScheme - 1));
  if (!caller.has_value()) {
    return WithReason(absl::UnauthenticatedError("the call's token is unknown or no longer valid; "
                                                 "ask the server's operator for a new one"),
                      v1::ERROR_REASON_TOKEN_UNKNOWN);
  }
  HULLD_RETURN_IF_ERROR(CheckPermission(*caller, rpc));
  return *caller;
}

}  // namespace hulld::server
