#include "client/hullctl/command_line/invocation.h"

#include <absl/strings/str_cat.h>

#include "client/calls/grpc_status.h"
#include "client/hullctl/command_line/tls_diagnosis.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

std::string WithHint(const std::string& message, const std::string& hint) {
  return absl::StrCat(message, " (", hint, ")");
}

std::string ExplainConnectionFailure(const std::string& message, const std::string& server,
                                     const ConnectionSecurity& security) {
  const std::string reason = DiagnoseTls(server, security);
  if (!reason.empty()) {
    return absl::StrCat("cannot connect to hulld at ", server, ": ", reason);
  }
  return absl::StrCat("cannot reach hulld at ", server,
                      "; start it with 'hulld', or choose another with --server (", message, ")");
}

std::string Explain(const absl::Status& status, const std::string& server,
                    std::chrono::milliseconds timeout, const ConnectionSecurity& security) {
  const std::string message(status.message().data(), status.message().size());
  // Errors without a reason come from gRPC itself.
  const v1::ErrorReason reason = ReasonOf(status);
  const bool is_hulld = reason != v1::ERROR_REASON_UNSPECIFIED;
  switch (status.code()) {
    case absl::StatusCode::kUnavailable:
      if (!is_hulld) return ExplainConnectionFailure(message, server, security);
      return absl::StrCat("hulld at ", server, " is unavailable: ", message, "; try again later");
    case absl::StatusCode::kDeadlineExceeded:
      return absl::StrCat("no answer from hulld at ", server, " within ", timeout.count(),
                          " ms; raise --timeout, or check the server with 'hullctl status' (",
                          message, ")");
    case absl::StatusCode::kUnauthenticated:
      return WithHint(message, "pass one with --token-file or $HULLD_TOKEN");
    case absl::StatusCode::kNotFound:
      return WithHint(message, reason == v1::ERROR_REASON_BODY_NOT_FOUND ? "see 'hullctl body list'"
                                                                         : "see 'hullctl list'");
    case absl::StatusCode::kAlreadyExists:
      if (reason == v1::ERROR_REASON_BODY_EXISTS) {
        return WithHint(message, "see 'hullctl body delete'");
      }
      return WithHint(message, "pass --if-absent to accept it, or see 'hullctl delete'");
    case absl::StatusCode::kAborted:
      return WithHint(message, "'hullctl get' shows the current revision");
    case absl::StatusCode::kUnimplemented:
      return absl::StrCat(
          server,
          " does not implement this call; check that it is hulld and not older than hullctl (",
          message, ")");
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnknown:
    case absl::StatusCode::kDataLoss: {
      const std::string id = RequestIdOf(status);
      return absl::StrCat("hulld at ", server, " failed: ", message, "; see its log",
                          id.empty() ? "" : " for request ", id);
    }
    case absl::StatusCode::kResourceExhausted:
      // gRPC rejects oversized messages before the server can name its limit.
      if (is_hulld) return message;
      return WithHint(message,
                      "the limit is --max-message-bytes of the server; send smaller messages");
    case absl::StatusCode::kFailedPrecondition:
      if (reason != v1::ERROR_REASON_SEQUENCE_GAP) return message;
      return WithHint(message,
                      "another program may append with the same --writer; use another name");
    default:
      return message;
  }
}

}  // namespace

Client Invocation::MakeClient() const {
  ClientOptions options;
  options.server = server;
  options.timeout = timeout();
  // Without --timeout, an unreachable server is reported within a second.
  if (!given_timeout.has_value()) options.retry.max_attempts = 4;
  options.security = security;
  options.freshness = freshness;
  return Client(std::move(options));
}

bool Invocation::PrintForPrograms(const google::protobuf::Message& message,
                                  const std::string& name) const {
  if (json()) out << MessageJson(message) << "\n";
  if (names()) out << name << "\n";
  return json() || names();
}

ExitCode Invocation::Fail(const absl::Status& status) const {
  err << "hullctl: " << Explain(status, server, timeout(), security) << "\n";
  const bool unreachable = absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status);
  return unreachable ? ExitCode::kUnreachable : ExitCode::kRequestFailed;
}

ExitCode Invocation::FailUsage(const absl::Status& status) const {
  return FailUsage(std::string(status.message()));
}

ExitCode Invocation::FailUsage(const std::string& message) const {
  err << "hullctl: " << message << "\n";
  return ExitCode::kUsage;
}

ExitCode Invocation::Judge(const Verification& verification) const {
  switch (verification.verdict) {
    case Verdict::kValid:
      return ExitCode::kDone;
    case Verdict::kInvalid:
      err << "hullctl: the certificate does not prove the answer: " << verification.reason << "\n";
      return ExitCode::kInvalidCertificate;
    case Verdict::kCannotCheck:
    case Verdict::kMoved:
      break;
  }
  err << "hullctl: the certificate cannot be checked: " << verification.reason << "\n";
  return ExitCode::kCannotCheck;
}

}  // namespace hulld
