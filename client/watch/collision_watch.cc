#include "client/watch/collision_watch.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "client/calls/grpc_status.h"

namespace hulld {
namespace {

constexpr int kPoseNumbers = 7;

absl::Status CheckUpdate(const v1::CollisionWatchOpen& open,
                         const v1::CollisionWatchUpdate& update) {
  if (update.poses_size() != kPoseNumbers * update.placements_size()) {
    return absl::InvalidArgumentError(absl::StrCat("poses: ", update.poses_size(), " numbers for ",
                                                   update.placements_size(),
                                                   " placements; each needs ", kPoseNumbers));
  }
  const v1::PackedPlacements& packed = open.packed_placements();
  const int count = std::max(open.placements_size(),
                             std::min(packed.hulls_size(), packed.poses_size() / kPoseNumbers));
  for (const uint32_t placement : update.placements()) {
    if (placement >= static_cast<uint32_t>(count)) {
      return absl::InvalidArgumentError(
          absl::StrCat("placements: placement ", placement,
                       " does not exist; the number of placements is ", count));
    }
  }
  return absl::OkStatus();
}

void SetPose(const double* numbers, v1::Placement* placement) {
  v1::Quaternion* const q = placement->mutable_pose()->mutable_rotation();
  q->set_w(numbers[0]);
  q->set_x(numbers[1]);
  q->set_y(numbers[2]);
  q->set_z(numbers[3]);
  v1::Vector3* const t = placement->mutable_pose()->mutable_translation();
  t->set_x(numbers[4]);
  t->set_y(numbers[5]);
  t->set_z(numbers[6]);
}

// Replaces the poses of the updated placements.
void Apply(const v1::CollisionWatchUpdate& update, v1::CollisionWatchOpen* open) {
  for (int i = 0; i < update.placements_size(); ++i) {
    const double* const numbers = update.poses().data() + kPoseNumbers * i;
    const auto placement = static_cast<int>(update.placements(i));
    if (open->placements_size() > 0) {
      SetPose(numbers, open->mutable_placements(placement));
    } else {
      std::copy_n(
          numbers, kPoseNumbers,
          open->mutable_packed_placements()->mutable_poses()->begin() + kPoseNumbers * placement);
    }
  }
}

}  // namespace

CollisionWatch::CollisionWatch(std::shared_ptr<v1::CollisionService::Stub> stub,
                               v1::CollisionWatchOpen open, RetryPolicy retry,
                               std::chrono::milliseconds reconnect_timeout)
    : stub_(std::move(stub)),
      retry_(std::move(retry)),
      reconnect_timeout_(reconnect_timeout),
      reported_(open),
      open_(std::move(open)) {}

CollisionWatch::~CollisionWatch() {
  Cancel();
  if (call_ != nullptr) Close(*call_).IgnoreError();
}

absl::StatusOr<v1::WatchCollisionsResponse> CollisionWatch::Next() {
  RetryPolicy retry = retry_;
  Deadline deadline;
  if (!connected_) deadline = retry.Now() + reconnect_timeout_;
  if (connected_) retry.max_attempts = std::numeric_limits<int>::max();
  if (!retry.wait) {
    retry.wait = [this](std::chrono::milliseconds backoff) {
      std::unique_lock lock(cancel_mutex_);
      cancellation_.wait_for(lock, backoff, [this] { return cancelled_; });
    };
  }
  for (int failures = 0;;) {
    const bool is_new = call_ == nullptr;
    if (is_new) call_ = Open();
    if (call_ == nullptr) return absl::CancelledError("the watch was cancelled");
    v1::WatchCollisionsResponse message;
    if (call_->stream->Read(&message)) {
      if (is_new && connected_) reported_.Restart();
      connected_ = true;
      reported_.Take(&message);
      message.set_update(call_->updates_before + message.update());
      return message;
    }
    const absl::Status status = Close(*call_);
    call_.reset();
    // A lost connection starts the deadline, because the watch may have been quiet for hours.
    if (failures == 0 && connected_) deadline = retry.Now() + reconnect_timeout_;
    if (!MayRetry(status) || !WaitBeforeRetry(retry, ++failures, deadline, status)) return status;
  }
}

absl::Status CollisionWatch::Update(const v1::CollisionWatchUpdate& update) {
  std::shared_ptr<Call> call;
  {
    const std::lock_guard lock(update_mutex_);
    if (absl::Status status = CheckUpdate(open_, update); !status.ok()) return status;
    Apply(update, &open_);
    ++updates_;
    call = updated_call_;
  }
  if (call == nullptr) return absl::OkStatus();
  v1::WatchCollisionsRequest request;
  *request.mutable_update() = update;
  // If this fails, the next call opens with the update.
  call->stream->Write(request);
  return absl::OkStatus();
}

std::shared_ptr<CollisionWatch::Call> CollisionWatch::Open() {
  const auto call = std::make_shared<Call>();
  {
    const std::lock_guard lock(cancel_mutex_);
    if (cancelled_) return nullptr;
    cancelled_call_ = call;
    call->stream = stub_->WatchCollisions(&call->context);
  }
  const std::lock_guard lock(update_mutex_);
  v1::WatchCollisionsRequest request;
  *request.mutable_open() = open_;
  call->updates_before = updates_;
  updated_call_ = call;
  // If this fails, Next returns the error.
  call->stream->Write(request);
  return call;
}

absl::Status CollisionWatch::Close(Call& call) {
  {
    const std::lock_guard lock(update_mutex_);
    updated_call_.reset();
  }
  absl::Status status = FromGrpcStatus(call.stream->Finish(), call.context);
  // The client never half-closes the stream, so the server has no reason to end it with OK.
  if (status.ok()) status = absl::InternalError("the server ended the watch without an error");
  const std::lock_guard lock(cancel_mutex_);
  cancelled_call_.reset();
  if (cancelled_) return absl::CancelledError("the watch was cancelled");
  return status;
}

void CollisionWatch::Cancel() {
  const std::lock_guard lock(cancel_mutex_);
  cancelled_ = true;
  cancellation_.notify_all();
  if (cancelled_call_ != nullptr) cancelled_call_->context.TryCancel();
}

}  // namespace hulld
