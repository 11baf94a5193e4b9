#include "client/calls/grpc_status.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>

#include <cstdint>

#include "hulld/rpc/error_details.pb.h"

namespace hulld {
namespace {

// Trailing metadata keys; also the keys of the status payloads that carry their values.
constexpr char kRequestId[] = "x-request-id";
constexpr char kRetry[] = "grpc-retry-pushback-ms";
// Type of the error detail; also the key of the status payload that carries it.
constexpr char kErrorInfo[] = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr char kDomain[] = "hulld";

void CarryOver(const char* key, const grpc::ClientContext& context, absl::Status* status) {
  const auto& trailing = context.GetServerTrailingMetadata();
  const auto found = trailing.find(key);
  if (found == trailing.end()) return;
  status->SetPayload(key, absl::Cord(std::string(found->second.data(), found->second.size())));
}

std::optional<rpc::ErrorInfo> InfoOf(const absl::Status& status) {
  const absl::optional<absl::Cord> payload = status.GetPayload(kErrorInfo);
  rpc::ErrorInfo info;
  if (!payload.has_value() || !info.ParseFromString(std::string(*payload)) ||
      info.domain() != kDomain) {
    return std::nullopt;
  }
  return info;
}

}  // namespace

absl::Status FromGrpcStatus(const grpc::Status& status) {
  // gRPC reports CANCELLED when a call reaches a server during its shutdown.
  if (status.error_code() == grpc::StatusCode::CANCELLED) {
    return absl::UnavailableError("the server ended the call because it is shutting down");
  }
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  rpc::Status details;
  if (result.ok() || !details.ParseFromString(status.error_details())) return result;
  for (const google::protobuf::Any& detail : details.details()) {
    if (detail.type_url() == kErrorInfo) result.SetPayload(kErrorInfo, absl::Cord(detail.value()));
  }
  return result;
}

absl::Status FromGrpcStatus(const grpc::Status& status, const grpc::ClientContext& context) {
  absl::Status result = FromGrpcStatus(status);
  if (result.ok()) return result;
  CarryOver(kRequestId, context, &result);
  CarryOver(kRetry, context, &result);
  return result;
}

v1::ErrorReason ReasonOf(const absl::Status& status) {
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
  const std::optional<rpc::ErrorInfo> info = InfoOf(status);
  if (info.has_value()) v1::ErrorReason_Parse("ERROR_REASON_" + info->reason(), &reason);
  return reason;
}

std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key) {
  const std::optional<rpc::ErrorInfo> info = InfoOf(status);
  if (!info.has_value()) return std::nullopt;
  const auto entry = info->metadata().find(key);
  if (entry == info->metadata().end()) return std::nullopt;
  return entry->second;
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
  // A negative number forbids a retry.
  if (milliseconds < 0) return std::nullopt;
  return std::chrono::milliseconds(milliseconds);
}

}  // namespace hulld
