#include "server/contract/error_info.h"

#include <absl/strings/cord.h>
#include <absl/strings/strip.h>

namespace hulld::server {
namespace {

constexpr char kDomain[] = "hulld";
constexpr char kReasonPrefix[] = "ERROR_REASON_";
// Status payload with a serialized ErrorInfo.
constexpr char kInfoPayload[] = "type.googleapis.com/google.rpc.ErrorInfo";

std::string ReasonName(v1::ErrorReason reason) {
  return std::string(absl::StripPrefix(v1::ErrorReason_Name(reason), kReasonPrefix));
}

// Returns the reason of codes that imply one.
v1::ErrorReason ImpliedReason(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kInvalidArgument:
      return v1::ERROR_REASON_INVALID_REQUEST;
    case absl::StatusCode::kResourceExhausted:
      return v1::ERROR_REASON_LIMIT_EXCEEDED;
    case absl::StatusCode::kUnavailable:
      return v1::ERROR_REASON_STORE_UNAVAILABLE;
    case absl::StatusCode::kDataLoss:
      return v1::ERROR_REASON_HULL_DAMAGED;
    default:
      return v1::ERROR_REASON_UNSPECIFIED;
  }
}

}  // namespace

absl::Status WithReason(absl::Status status, v1::ErrorReason reason,
                        std::initializer_list<MetadataEntry> metadata) {
  rpc::ErrorInfo info;
  info.set_reason(ReasonName(reason));
  info.set_domain(kDomain);
  for (const MetadataEntry& entry : metadata) (*info.mutable_metadata())[entry.key] = entry.value;
  status.SetPayload(kInfoPayload, absl::Cord(info.SerializeAsString()));
  return status;
}

absl::Status Draining() {
  return WithReason(
      absl::UnavailableError("hulld is shutting down; retry later or on another server"),
      v1::ERROR_REASON_DRAINING);
}

v1::ErrorReason ReasonOf(const absl::Status& status) {
  v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED;
  if (const std::optional<rpc::ErrorInfo> info = ErrorInfoOf(status); info.has_value()) {
    v1::ErrorReason_Parse(kReasonPrefix + info->reason(), &reason);
  }
  return reason;
}

std::optional<std::string> MetadataOf(const absl::Status& status, const std::string& key) {
  const std::optional<rpc::ErrorInfo> info = ErrorInfoOf(status);
  if (!info.has_value()) return std::nullopt;
  const auto entry = info->metadata().find(key);
  if (entry == info->metadata().end()) return std::nullopt;
  return entry->second;
}

std::optional<rpc::ErrorInfo> ErrorInfoOf(const absl::Status& status) {
  const absl::optional<absl::Cord> payload = status.GetPayload(kInfoPayload);
  rpc::ErrorInfo info;
  if (payload.has_value() && info.ParseFromString(std::string(*payload))) return info;
  const v1::ErrorReason reason = ImpliedReason(status.code());
  if (reason == v1::ERROR_REASON_UNSPECIFIED) return std::nullopt;
  return ErrorInfoOf(WithReason(status, reason));
}

}  // namespace hulld::server
