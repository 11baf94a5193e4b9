#include "client/hullctl/command_line/invocation.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "client/calls/grpc_status.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
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
  const std::string message(status.message());
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

// Returns the freshness of the invocation for options to fill.
v1::Freshness* FreshnessOf(Invocation* invocation) {
  if (!invocation->freshness.has_value()) invocation->freshness.emplace();
  return &*invocation->freshness;
}

absl::Status TakeBound(const std::string& text, v1::Freshness* freshness) {
  const absl::StatusOr<std::chrono::milliseconds> bound = ParseDuration(text);
  if (!bound.ok()) return bound.status();
  freshness->mutable_max_staleness()->set_seconds(bound->count() / 1000);
  freshness->mutable_max_staleness()->set_nanos(static_cast<int32_t>(bound->count() % 1000) *
                                                1'000'000);
  return absl::OkStatus();
}

absl::Status TakeRevision(const std::string& text, v1::Freshness* freshness) {
  const size_t colon = text.rfind(':');
  uint64_t revision = 0;
  const bool is_read = colon != std::string::npos && colon > 0 &&
                       absl::SimpleAtoi(text.substr(colon + 1), &revision);
  if (!is_read) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(text),
                     " is not STORE:REVISION, the storeId and the revision of an answer's header "
                     "(--output json)"));
  }
  freshness->set_store_id(text.substr(0, colon));
  freshness->set_at_least_revision(revision);
  return absl::OkStatus();
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
  return PrintForPrograms(json() ? MessageJson(message) : "", name);
}

bool Invocation::PrintForPrograms(const std::string& text, const std::string& name) const {
  if (json()) out << text << "\n";
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

ExitCode Invocation::WriteFile(const std::string& path,
                               const std::function<void(std::ostream&)>& write) const {
  if (path.empty() || path == "-") {
    write(out);
    return ExitCode::kDone;
  }
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  if (!file)
    return FailUsage(absl::StrCat("cannot open ", path, " for writing: ", strerror(errno)));
  write(file);
  file.close();
  if (file) return ExitCode::kDone;
  return FailUsage(absl::StrCat("cannot write ", path, ": ", strerror(errno)));
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

void AddFreshnessOptions(Command command, Invocation* invocation) {
  command
      .AddParsed(
          "--max-staleness",
          [invocation](const std::string& text) {
            return TakeBound(text, FreshnessOf(invocation));
          },
          "With several servers over one store: accept answers that are at most this old, such as "
          "200ms (default: answers include every acknowledged change)")
      .ValueName("TIME");
  command
      .AddParsed(
          "--at-least",
          [invocation](const std::string& text) {
            return TakeRevision(text, FreshnessOf(invocation));
          },
          "Accept this revision of the store or a later one; it is in the header of an earlier "
          "answer")
      .ValueName("STORE:REVISION");
}

}  // namespace hulld
