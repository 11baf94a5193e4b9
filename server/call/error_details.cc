#include "server/call/error_details.h"

#include <chrono>
#include <optional>

#include "hulld/rpc/error_details.pb.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/contract/status_map.h"

namespace hulld::server {
namespace {

// detail: a message of hulld.rpc, which has the fields of the type in google.rpc with its name.
void AddDetail(const google::protobuf::Message& detail, rpc::Status* message) {
  google::protobuf::Any* const any = message->add_details();
  any->set_type_url("type.googleapis.com/google.rpc." + detail.GetDescriptor()->name());
  detail.SerializeToString(any->mutable_value());
}

}  // namespace

std::string EncodeErrorDetails(const absl::Status& status, const std::string& request_id) {
  rpc::Status message;
  message.set_code(ToGrpc(status.code()));
  message.set_message(std::string(status.message()));
  rpc::RequestInfo request;
  request.set_request_id(request_id);
  AddDetail(request, &message);
  if (const auto info = ErrorInfoOf(status); info.has_value()) AddDetail(*info, &message);
  if (const auto flag = ExceededLimit(status); flag.has_value()) {
    rpc::QuotaFailure failure;
    rpc::QuotaFailure::Violation* const violation = failure.add_violations();
    violation->set_subject("--" + *flag);
    violation->set_description(std::string(status.message()));
    AddDetail(failure, &message);
  }
  if (const auto delay = RetryAfter(status); delay.has_value()) {
    rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(delay->count() / 1000);
    retry.mutable_retry_delay()->set_nanos(static_cast<int32_t>(delay->count() % 1000 * 1'000'000));
    AddDetail(retry, &message);
  }
  return message.SerializeAsString();
}

}  // namespace hulld::server
