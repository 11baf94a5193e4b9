#include "server/contract/errors.h"

#include <absl/strings/cord.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
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

// Metadata keys of error.proto.
constexpr char kFlag[] = "flag";
constexpr char kLimit[] = "limit";
// Status payload, read at the end of the call.
constexpr char kRetryPayload[] = "hulld/retry-ms";

}  // namespace

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  return grpc::Status(ToGrpc(status.code()), std::string(status.message()));
}

absl::Status Prefixed(const std::string& prefix, const absl::Status& status) {
  if (status.ok()) return status;
  absl::Status prefixed(status.code(), absl::StrCat(prefix, status.message()));
  status.ForEachPayload([&prefixed](absl::string_view type, const absl::Cord& payload) {
    prefixed.SetPayload(type, payload);
  });
  return prefixed;
}

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
  return WithReason(Unavailable("hulld is shutting down; retry later or on another server"),
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

absl::Status AtLimit(const absl::Status& status, uint64_t limit, const std::string& flag) {
  return WithReason(absl::ResourceExhaustedError(absl::StrCat(status.message(), " (--", flag, ")")),
                    v1::ERROR_REASON_LIMIT_EXCEEDED, {{kFlag, flag}, {kLimit, limit}});
}

absl::Status LimitExceeded(const std::string& what, const std::string& limit,
                           const std::string& flag) {
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat(what, "; the limit is ", limit, " (--", flag, ")")),
      v1::ERROR_REASON_LIMIT_EXCEEDED, {{kFlag, flag}, {kLimit, limit}});
}

absl::Status LimitExceeded(const std::string& what, uint64_t limit, const std::string& flag) {
  return LimitExceeded(what, std::to_string(limit), flag);
}

absl::Status Overloaded(const std::string& what, uint64_t limit, const std::string& flag,
                        std::chrono::milliseconds retry) {
  absl::Status status = WithReason(LimitExceeded(what, limit, flag), v1::ERROR_REASON_OVERLOADED,
                                   {{kFlag, flag}, {kLimit, limit}});
  status.SetPayload(kRetryPayload, absl::Cord(std::to_string(retry.count())));
  return status;
}

std::optional<std::string> ExceededLimit(const absl::Status& status) {
  return MetadataOf(status, kFlag);
}

std::optional<std::chrono::milliseconds> RetryAfter(const absl::Status& status) {
  const absl::optional<absl::Cord> retry = status.GetPayload(kRetryPayload);
  int64_t milliseconds = 0;
  if (!retry.has_value() || !absl::SimpleAtoi(std::string(*retry), &milliseconds)) {
    return std::nullopt;
  }
  return std::chrono::milliseconds(milliseconds);
}

}  // namespace hulld::server
