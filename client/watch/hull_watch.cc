#include "client/watch/hull_watch.h"

#include <limits>
#include <utility>

#include "client/calls/grpc_status.h"

namespace hulld {

HullWatch::HullWatch(std::shared_ptr<v1::HullService::Stub> stub, v1::WatchHullsRequest request,
                     RetryPolicy retry, std::chrono::milliseconds reconnect_timeout)
    : stub_(std::move(stub)),
      request_(std::move(request)),
      retry_(std::move(retry)),
      reconnect_timeout_(reconnect_timeout) {}

HullWatch::~HullWatch() {
  Cancel();
  if (call_ != nullptr) Close().IgnoreError();
}

absl::StatusOr<v1::WatchHullsResponse> HullWatch::Next() {
  RetryPolicy retry = retry_;
  Deadline deadline;
  if (!connected_) deadline = retry.Now() + reconnect_timeout_;
  if (connected_) retry.max_attempts = std::numeric_limits<int>::max();
  if (!retry.wait) {
    retry.wait = [this](std::chrono::milliseconds backoff) {
      std::unique_lock lock(mutex_);
      cancellation_.wait_for(lock, backoff, [this] { return cancelled_; });
    };
  }
  for (int failures = 0;;) {
    const bool is_new = call_ == nullptr;
    Call* const call = is_new ? Open() : call_.get();
    if (call == nullptr) return absl::CancelledError("the watch was cancelled");
    v1::WatchHullsResponse message;
    if (call->reader->Read(&message)) {
      // A call that could not resume sends the full state but not the deletions since the loss.
      if (is_new && reported_ && request_.after_revision() == 0) message.set_restarted(true);
      connected_ = true;
      reported_ = reported_ || message.events_size() > 0;
      request_.set_after_revision(message.header().revision());
      request_.set_store_id(message.header().store_id());
      return message;
    }
    const absl::Status status = Close();
    // A lost connection starts the deadline, because the watch may have been quiet for hours.
    if (failures == 0 && connected_) deadline = retry.Now() + reconnect_timeout_;
    if (!MayRetry(status) || !WaitBeforeRetry(retry, ++failures, deadline, status)) return status;
  }
}

HullWatch::Call* HullWatch::Open() {
  const std::lock_guard lock(mutex_);
  if (cancelled_) return nullptr;
  call_ = std::make_unique<Call>();
  call_->reader = stub_->WatchHulls(&call_->context, request_);
  return call_.get();
}

absl::Status HullWatch::Close() {
  const absl::Status status = FromGrpcStatus(call_->reader->Finish(), call_->context);
  const std::lock_guard lock(mutex_);
  call_.reset();
  if (cancelled_) return absl::CancelledError("the watch was cancelled");
  return status;
}

void HullWatch::Cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  cancellation_.notify_all();
  if (call_ != nullptr) call_->context.TryCancel();
}

}  // namespace hulld
