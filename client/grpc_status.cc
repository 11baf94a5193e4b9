#include "client/grpc_status.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>

#include <cstdint>

namespace hulld {
namespace {

// Keys of the trailing metadata, and of the payloads that carry their values.
constexpr char kRequestId[] = "x-request-id";
constexpr char kRetry[] = "grpc-retry-pushback-ms";

void CarryOver(const char* key, const grpc::ClientContext& context, absl::Status* status) {
  const auto& trailing = context.GetServerTrailingMetadata();
  const auto found = trailing.find(key);
  if (found == trailing.end()) return;
  status->SetPayload(key, absl::Cord(std::string(found->second.data(), found->second.size())));
}

}  // namespace

absl::Status FromGrpcStatus(const grpc::Status& status, const grpc::ClientContext& context) {
  absl::Status result = FromGrpcStatus(status);
  if (result.ok()) return result;
  CarryOver(kRequestId, context, &result);
  CarryOver(kRetry, context, &result);
  return result;
}

std::string RequestIdOf(const absl::Status& status) {
  const absl::optional<absl::Cord> id = status.GetPayload(kRequestId);
  return id.has_value() ? std::string(*id) : "";
}

std::optional<std::chrono::milliseconds> RetryHintOf(const absl::Status& status) {
  const absl::optional<absl::Cord> hint = status.GetPayload(kRetry);
  int64_t milliseconds = 0;
  if (!hint.has_value() || !absl::SimpleAtoi(std::string(*hint), &milliseconds)) {
    return std::nullopt;
  }
  // A negative number asks not to.
  if (milliseconds < 0) return std::nullopt;
  return std::chrono::milliseconds(milliseconds);
}

}  // namespace hulld
