#include "client/collision_stream.h"

#include <utility>

#include "client/calls/grpc_status.h"

namespace hulld {
namespace {

// Appends a part of an answer. Problems name rows of their own part.
void Append(const v1::StreamCollisionsResponse& piece, v1::StreamCollisionsResponse* answer) {
  const int before = answer->pairs_size();
  const int problems = answer->columns().pair_problems_size();
  answer->MergeFrom(piece);
  v1::AnswerColumns* const columns = answer->mutable_columns();
  for (int i = problems; i < columns->pair_problems_size(); ++i) {
    v1::PairProblem* const problem = columns->mutable_pair_problems(i);
    problem->set_row(problem->row() + static_cast<uint64_t>(before));
  }
}

}  // namespace

CollisionStream::CollisionStream(std::shared_ptr<v1::CollisionService::Stub> stub,
                                 std::chrono::milliseconds timeout,
                                 std::optional<v1::Freshness> freshness)
    : stub_(std::move(stub)), timeout_(timeout), freshness_(std::move(freshness)) {
  stub_->async()->StreamCollisions(&context_, this);
  AddHold();
  StartRead(&incoming_);
  StartCall();
}

CollisionStream::~CollisionStream() {
  context_.TryCancel();
  ReleaseHold();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return done_; });
}

absl::StatusOr<v1::StreamCollisionsResponse> CollisionStream::Open(v1::CollisionStreamOpen open) {
  if (freshness_.has_value() && !open.has_freshness()) *open.mutable_freshness() = *freshness_;
  *request_.mutable_open() = std::move(open);
  return Exchange();
}

absl::StatusOr<v1::StreamCollisionsResponse> CollisionStream::Update(
    v1::CollisionStreamUpdate update) {
  *request_.mutable_update() = std::move(update);
  return Exchange();
}

absl::StatusOr<v1::StreamCollisionsResponse> CollisionStream::Exchange() {
  std::unique_lock lock(mutex_);
  if (!held_ || reads_ended_) {
    lock.unlock();
    return Ended();
  }
  answer_.Clear();
  answered_ = false;
  written_ = false;
  lock.unlock();
  StartWrite(&request_);
  lock.lock();
  const bool in_time =
      changed_.wait_for(lock, timeout_, [this] { return (answered_ && written_) || reads_ended_; });
  if (in_time && answered_) return std::move(answer_);
  lock.unlock();
  return in_time ? Ended() : TimeOut();
}

absl::Status CollisionStream::Close() {
  if (held_) StartWritesDone();
  ReleaseHold();
  std::unique_lock lock(mutex_);
  const bool in_time = changed_.wait_for(lock, timeout_, [this] { return done_; });
  lock.unlock();
  return in_time ? WaitUntilDone() : TimeOut();
}

// Ends the stream of a server that does not answer.
absl::Status CollisionStream::TimeOut() {
  context_.TryCancel();
  WaitUntilDone().IgnoreError();
  status_ = {grpc::StatusCode::DEADLINE_EXCEEDED,
             absl::StrCat("the server did not answer within ", timeout_.count(), " ms")};
  return WaitUntilDone();
}

// Returns the error that ended the stream.
absl::Status CollisionStream::Ended() {
  const absl::Status status = WaitUntilDone();
  return status.ok() ? absl::InternalError("the server ended the stream before its answer")
                     : status;
}

absl::Status CollisionStream::WaitUntilDone() {
  ReleaseHold();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return done_; });
  return FromGrpcStatus(status_, context_);
}

void CollisionStream::ReleaseHold() {
  if (!std::exchange(held_, false)) return;
  RemoveHold();
}

// Wakes the waiting thread once, when its complete answer has arrived, and outside the mutex to
// avoid contention.
void CollisionStream::OnReadDone(bool ok) {
  bool is_over = false;
  {
    const std::lock_guard lock(mutex_);
    if (ok) {
      answered_ = incoming_.last();
      Append(incoming_, &answer_);
    } else {
      reads_ended_ = true;
    }
    is_over = reads_ended_ || (answered_ && written_);
  }
  if (is_over) changed_.notify_all();
  if (!ok) return;
  incoming_.Clear();
  StartRead(&incoming_);
}

void CollisionStream::OnWriteDone(bool /*ok*/) {
  // After a failed write the pending reads fail too, and OnDone reports the status.
  bool is_over = false;
  {
    const std::lock_guard lock(mutex_);
    written_ = true;
    is_over = answered_;
  }
  if (is_over) changed_.notify_all();
}

void CollisionStream::OnDone(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  status_ = status;
  done_ = true;
  changed_.notify_all();
}

}  // namespace hulld
