#include "server/call/error_details.h"

#include <chrono>
#include <optional>

#include "hulld/rpc/error_details.pb.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/contract/status_map.h"

namespace hulld::server {
namespace {

// bytes: a serialized message of the Google type `type`.
void AddDetail(const std::string& type, const std::string& bytes, rpc::Status* message) {
  google::protobuf::Any* const detail = message->add_details();
  detail->set_type_url("type.googleapis.com/google.rpc." + type);
  detail->set_value(bytes);
}

std::string EncodeRequestInfo(const std::string& request_id) {
  rpc::RequestInfo info;
  info.set_request_id(request_id);
  return info.SerializeAsString();
}

std::string EncodeQuotaFailure(const std::string& flag, const absl::Status& status) {
  rpc::QuotaFailure failure;
  rpc::QuotaFailure::Violation* const violation = failure.add_violations();
  violation->set_subject("--" + flag);
  violation->set_description(std::string(status.message()));
  return failure.SerializeAsString();
}

std::string EncodeRetryInfo(std::chrono::milliseconds delay) {
  rpc::RetryInfo info;
  info.mutable_retry_delay()->set_seconds(delay.count() / 1000);
  info.mutable_retry_delay()->set_nanos(static_cast<int32_t>(delay.count() % 1000 * 1'000'000));
  return info.SerializeAsString();
}

}  // namespace

std::string EncodeErrorDetails(const absl::Status& status, const std::string& request_id) {
  rpc::Status message;
  message.set_code(ToGrpc(status.code()));
  message.set_message(std::string(status.message()));
  AddDetail("RequestInfo", EncodeRequestInfo(request_id), &message);
  if (const auto info = EncodeErrorInfo(status); info.has_value()) {
    AddDetail("ErrorInfo", *info, &message);
  }
  if (const auto flag = ExceededLimit(status); flag.has_value()) {
    AddDetail("QuotaFailure", EncodeQuotaFailure(*flag, status), &message);
  }
  if (const auto delay = RetryAfter(status); delay.has_value()) {
    AddDetail("RetryInfo", EncodeRetryInfo(*delay), &message);
  }
  return message.SerializeAsString();
}

}  // namespace hulld::server
