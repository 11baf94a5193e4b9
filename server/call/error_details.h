#ifndef HULLD_SERVER_CALL_ERROR_DETAILS_H_
#define HULLD_SERVER_CALL_ERROR_DETAILS_H_

#include <absl/status/status.h>

#include <string>

namespace hulld::server {

// Returns the value of an error's trailing metadata grpc-status-details-bin: a serialized
// google.rpc.Status (google/rpc/status.proto) with the applicable details of
// google/rpc/error_details.proto:
//   RequestInfo   always: request_id
//   ErrorInfo     when the error has a reason: see v1/error.proto
//   QuotaFailure  when a limit caused the error: subject is its flag
//   RetryInfo     when the same request may soon succeed: retry_delay
std::string EncodeErrorDetails(const absl::Status& status, const std::string& request_id);

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_ERROR_DETAILS_H_
