#include "tests/fuzz/service/service_contract.h"

#include <absl/strings/str_cat.h>

#include <set>

#include "client/calls/grpc_status.h"

namespace hulld::fuzz {
namespace {

using server::Rpc;
using Codes = std::set<grpc::StatusCode>;

// Returns the codes of a call besides OK and the codes of all calls.
Codes CodesOf(Rpc rpc) {
  switch (rpc) {
    case Rpc::kCreateHull:
      return {grpc::INVALID_ARGUMENT, grpc::ALREADY_EXISTS};
    case Rpc::kAppendPoints:
      return {grpc::INVALID_ARGUMENT, grpc::NOT_FOUND, grpc::FAILED_PRECONDITION, grpc::ABORTED,
              grpc::ALREADY_EXISTS};
    case Rpc::kReplaceHull:
      return {grpc::INVALID_ARGUMENT, grpc::NOT_FOUND, grpc::ABORTED, grpc::ALREADY_EXISTS};
    case Rpc::kGetHull:
    case Rpc::kGetHullMesh:
    case Rpc::kCheckCollision:
    case Rpc::kGetBody:
      return {grpc::INVALID_ARGUMENT, grpc::NOT_FOUND, grpc::FAILED_PRECONDITION};
    case Rpc::kListHulls:
    case Rpc::kListBodies:
    case Rpc::kBatchCheckCollisions:
    case Rpc::kStreamCollisions:
    case Rpc::kFindCollisions:
      return {grpc::INVALID_ARGUMENT, grpc::FAILED_PRECONDITION};
    case Rpc::kWatchHulls:
    case Rpc::kWatchCollisions:
      return {grpc::INVALID_ARGUMENT};
    case Rpc::kDeleteHull:
      return {grpc::INVALID_ARGUMENT, grpc::NOT_FOUND, grpc::ABORTED};
    case Rpc::kPutBody:
      return {grpc::INVALID_ARGUMENT, grpc::ALREADY_EXISTS, grpc::ABORTED};
    case Rpc::kDeleteBody:
      return {grpc::INVALID_ARGUMENT, grpc::NOT_FOUND, grpc::ABORTED};
    case Rpc::kSaveBackup:
      return {grpc::FAILED_PRECONDITION};
    case Rpc::kServerReflectionInfo:
      return {grpc::INVALID_ARGUMENT};
    case Rpc::kGetStatus:
    case Rpc::kHealthWatch:
      return {};
  }
  return {};
}

// Checks that an error of hulld has its reason. gRPC itself refuses messages that are too large.
std::string CheckReason(Rpc rpc, const grpc::Status& status) {
  if (ReasonOf(FromGrpcStatus(status)) != v1::ERROR_REASON_UNSPECIFIED) return {};
  if (status.error_details().empty() && status.error_code() == grpc::RESOURCE_EXHAUSTED) return {};
  return absl::StrCat(server::RpcName(rpc), " returned no error reason for: \"",
                      status.error_message(), "\"");
}

}  // namespace

std::string CheckStatus(Rpc rpc, const CallManner& manner, const grpc::Status& status) {
  const grpc::StatusCode code = status.error_code();
  if (code == grpc::OK) return {};
  // Reported by gRPC itself.
  if (manner.hurried && code == grpc::DEADLINE_EXCEEDED) return {};
  if (manner.cancelled && code == grpc::CANCELLED) return {};
  Codes codes = CodesOf(rpc);
  if (manner.raw) codes.insert(grpc::INVALID_ARGUMENT);
  codes.insert(grpc::RESOURCE_EXHAUSTED);
  if (codes.count(code) > 0 && !status.error_message().empty()) return CheckReason(rpc, status);
  return absl::StrCat(server::RpcName(rpc), " ended ", CodeName(code), ": \"",
                      status.error_message(), "\"");
}

std::string CodeName(grpc::StatusCode code) {
  static constexpr const char* kNames[] = {"OK",
                                           "CANCELLED",
                                           "UNKNOWN",
                                           "INVALID_ARGUMENT",
                                           "DEADLINE_EXCEEDED",
                                           "NOT_FOUND",
                                           "ALREADY_EXISTS",
                                           "PERMISSION_DENIED",
                                           "RESOURCE_EXHAUSTED",
                                           "FAILED_PRECONDITION",
                                           "ABORTED",
                                           "OUT_OF_RANGE",
                                           "UNIMPLEMENTED",
                                           "INTERNAL",
                                           "UNAVAILABLE",
                                           "DATA_LOSS",
                                           "UNAUTHENTICATED"};
  return code >= 0 && code < 17 ? kNames[code] : absl::StrCat("code ", static_cast<int>(code));
}

}  // namespace hulld::fuzz
