#include "server/call/call.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/base/status_macros.h"
#include "hulld/rpc/error_details.pb.h"
#include "server/access/guard.h"
#include "server/contract/errors.h"
#include "server/process/random_id.h"

namespace hulld::server {
namespace {

constexpr char kRequestIdKey[] = "x-request-id";
constexpr size_t kMaxRequestIdCharacters = 128;
constexpr char kTraceKey[] = "traceparent";
// Also honored by gRPC's own retries.
constexpr char kRetryKey[] = "grpc-retry-pushback-ms";

double Milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

// Returns true if `text` is a valid request ID: 1 to 128 letters, digits or -_.:/+=, safe in logs
// and metadata without escaping.
bool IsRequestId(const std::string& text) {
  return !text.empty() && text.size() <= kMaxRequestIdCharacters &&
         std::ranges::all_of(text, [](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
                  std::string_view("-_.:/+=").find(c) != std::string_view::npos;
         });
}

// Returns a unique request ID: a random part for the process, with 64 bits, followed by a counter.
// Cost: ~100 ns.
std::string NextRequestId() {
  static const std::string kProcess = RandomId().substr(0, 16);
  static std::atomic<uint64_t> last = 0;
  return absl::StrCat(kProcess, "-", last.fetch_add(1, std::memory_order_relaxed) + 1);
}

// Returns true if --max-request-time limits each message of the client rather than the call.
bool IsTimedByMessage(Rpc rpc) {
  return rpc == Rpc::kStreamCollisions || rpc == Rpc::kWatchCollisions;
}

// Returns true if the error is a fault of the server.
bool IsFault(absl::StatusCode code) {
  return code == absl::StatusCode::kInternal || code == absl::StatusCode::kUnknown ||
         code == absl::StatusCode::kDataLoss;
}

// detail: a message of hulld.rpc, which has the fields of the type in google.rpc with its name.
void AddDetail(const google::protobuf::Message& detail, rpc::Status* message) {
  google::protobuf::Any* const any = message->add_details();
  any->set_type_url("type.googleapis.com/google.rpc." + detail.GetDescriptor()->name());
  detail.SerializeToString(any->mutable_value());
}

// Returns the value of an error's trailing metadata grpc-status-details-bin: a serialized
// google.rpc.Status (google/rpc/status.proto) with the applicable details of
// google/rpc/error_details.proto:
//   RequestInfo   always: request_id
//   ErrorInfo     when the error has a reason: see v1/error.proto
//   QuotaFailure  when a limit caused the error: subject is its flag
//   RetryInfo     when the same request may soon succeed: retry_delay
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
    *retry.mutable_retry_delay() =
        google::protobuf::util::TimeUtil::MillisecondsToDuration(delay->count());
    AddDetail(retry, &message);
  }
  return message.SerializeAsString();
}

}  // namespace

absl::Status Call::Begin(std::function<void()> on_revoked) {
  // Skips work for cancelled calls, because many may be cancelled together.
  if (context_.IsCancelled()) return absl::CancelledError("the call was cancelled");
  const auto& metadata = context_.client_metadata();
  const auto given = metadata.find(kRequestIdKey);
  if (given != metadata.end()) {
    const std::string id(given->second.data(), given->second.size());
    request_id_exposed_ = true;
    if (IsRequestId(id)) std::call_once(request_id_made_, [&] { request_id_ = id; });
  }
  // Ignored if repeated.
  if (metadata.count(kTraceKey) == 1) {
    const grpc::string_ref text = metadata.find(kTraceKey)->second;
    trace_ = TraceContext::Parse({text.data(), text.size()});
  }
  const Guard* const guard = admission_.guard();
  if (guard != nullptr && PermissionFor(rpc_) != Permission::kNone) {
    HULLD_ASSIGN_OR_RETURN(caller_, guard->Authenticate(metadata, rpc_));
  }
  const std::optional<PeerAddress> peer = PeerAddress::FromGrpc(peer_);
  HULLD_ASSIGN_OR_RETURN(Admission::Ticket ticket,
                         admission_.Admit({rpc_, Client(peer), peer, context_.c_call(), caller_,
                                           &lifetime_, std::move(on_revoked)}));
  ticket_.emplace(std::move(ticket));
  // The tokens may have changed before the call was registered as running.
  if (!caller_.name.empty() && !guard->Knows(caller_)) {
    lifetime_.Revoke();
    return lifetime_.StopStatus();
  }
  if (KindOf(rpc_) != CallKind::kStream) lifetime_.LimitTime(admission_.limits().max_request_time);
  return absl::OkStatus();
}

const std::string& Call::request_id() const {
  std::call_once(request_id_made_, [this] { request_id_ = NextRequestId(); });
  request_id_exposed_ = true;
  return request_id_;
}

std::string Call::Client(const std::optional<PeerAddress>& peer) const {
  if (!caller_.name.empty()) return "token:" + caller_.name;
  return peer.has_value() ? peer->NetworkName() : peer_;
}

void Call::BeginMessage() {
  message_arrival_ = Clock::now();
  if (IsTimedByMessage(rpc_)) lifetime_.LimitTime(admission_.limits().max_request_time);
}

void Call::EndMessage(Clock::time_point arrival) {
  const Clock::duration duration = Clock::now() - arrival;
  metrics().CountMessage(rpc_, duration);
  if (IsTimedByMessage(rpc_)) lifetime_.LimitTime(std::chrono::milliseconds::zero());
  LogSlow(duration, absl::OkStatus(), "slow message");
}

void Call::CountLimit(const absl::Status& status) const {
  const std::optional<std::string> limit = ExceededLimit(status);
  if (limit.has_value()) metrics().CountLimit(*limit);
}

void Call::Log(LogLevel level, const std::string& message, LogFields fields) const {
  if (!spdlog::should_log(level)) return;
  LogFields all = {{"rpc", RpcName(rpc_)}, {"request_id", request_id()}};
  if (trace_.has_value()) {
    all.push_back({"trace_id", trace_->trace_id()});
    all.push_back({"parent_id", trace_->parent_id()});
  }
  all.insert(all.end(), std::make_move_iterator(fields.begin()),
             std::make_move_iterator(fields.end()));
  LogEvent(level, message, all);
}

void Call::LogChange(const std::string& message, const LogField& changed, uint64_t revision,
                     const LogFields& fields) const {
  LogFields all;
  if (!caller_.name.empty()) all.push_back({"token", caller_.name});
  all.push_back({"peer", peer_});
  all.push_back(changed);
  all.push_back({"revision", revision});
  all.insert(all.end(), fields.begin(), fields.end());
  Log(LogLevel::info, message, std::move(all));
}

void Call::LogSlow(Clock::duration duration, const absl::Status& status, const char* what) const {
  const auto threshold = admission_.limits().slow_request;
  if (threshold == std::chrono::milliseconds::zero() || duration < threshold) return;
  Log(LogLevel::warn, what,
      {{"peer", peer_},
       {"code", absl::StatusCodeToString(status.code())},
       {"milliseconds", Milliseconds(duration)},
       {"pairs", pairs_.load(std::memory_order_relaxed)},
       {"points", points_.load(std::memory_order_relaxed)}});
}

grpc::Status Call::End(absl::Status status) {
  if (absl::IsCancelled(status) && ShouldStop()) status = StopStatus();
  const Clock::duration duration = Clock::now() - arrival_;
  metrics().CountCall(rpc_, status.code(), duration);
  if (KindOf(rpc_) != CallKind::kStream) LogSlow(duration, status, "slow request");
  metrics().CountToken(caller_.name);
  if (trace_.has_value()) context_.AddTrailingMetadata(kTraceKey, trace_->text());
  if (!status.ok() || request_id_exposed_)
    context_.AddTrailingMetadata(kRequestIdKey, request_id());
  if (status.ok()) return grpc::Status::OK;
  CountLimit(status);
  if (absl::IsUnauthenticated(status)) metrics().CountAuthFailure("unauthenticated");
  if (absl::IsPermissionDenied(status)) metrics().CountAuthFailure("permission_denied");
  const LogLevel level = IsFault(status.code()) ? LogLevel::err : LogLevel::debug;
  if (spdlog::should_log(level)) {
    Log(level, "request failed",
        {{"peer", peer_},
         {"code", absl::StatusCodeToString(status.code())},
         {"milliseconds", Milliseconds(duration)},
         {"error", std::string(status.message())}});
  }
  if (const auto retry = RetryAfter(status); retry.has_value()) {
    context_.AddTrailingMetadata(kRetryKey, absl::StrCat(retry->count()));
  }
  const grpc::Status plain = ToGrpc(status);
  return grpc::Status(plain.error_code(), plain.error_message(),
                      EncodeErrorDetails(status, request_id()));
}

}  // namespace hulld::server
