#include "client/append_connection.h"

#include <utility>

#include "client/base/check.h"

namespace hulld {

AppendConnection::AppendConnection(v1::HullService::Stub* stub) {
  stub->async()->AppendPoints(&context_, this);
  AddHold();
  StartRead(&incoming_);
  StartCall();
}

AppendConnection::~AppendConnection() {
  std::unique_lock lock(mutex_);
  if (!done_) context_.TryCancel();
  lock.unlock();
  ReleaseHold();
  lock.lock();
  changed_.wait(lock, [this] { return done_; });
}

void AppendConnection::ReleaseHold() {
  if (!std::exchange(held_, false)) return;
  RemoveHold();
}

bool AppendConnection::writable() {
  const std::lock_guard lock(mutex_);
  return writing_ == nullptr && !write_failed_ && !reads_ended_;
}

void AppendConnection::Write(std::shared_ptr<const v1::AppendPointsRequest> request) {
  const v1::AppendPointsRequest* message = request.get();
  {
    const std::lock_guard lock(mutex_);
    HULLD_CLIENT_CHECK(writing_ == nullptr);
    writing_ = std::move(request);
  }
  StartWrite(message);
}

void AppendConnection::WritesDone() { StartWritesDone(); }

bool AppendConnection::TakeResponse(v1::AppendPointsResponse* response) {
  const std::lock_guard lock(mutex_);
  if (responses_.empty()) return false;
  *response = std::move(responses_.front());
  responses_.pop_front();
  return true;
}

bool AppendConnection::WaitForEvent(bool to_write, Deadline deadline) {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [this, to_write] {
    return !responses_.empty() || reads_ended_ ||
           (to_write && writing_ == nullptr && !write_failed_);
  });
}

bool AppendConnection::ended() {
  const std::lock_guard lock(mutex_);
  return reads_ended_;
}

grpc::Status AppendConnection::Close() {
  HULLD_CLIENT_CHECK(ended());
  ReleaseHold();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return done_; });
  return status_;
}

const grpc::ClientContext& AppendConnection::context() {
  const std::lock_guard lock(mutex_);
  HULLD_CLIENT_CHECK(done_);
  return context_;
}

void AppendConnection::OnReadDone(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    if (ok) {
      responses_.push_back(std::move(incoming_));
    } else {
      reads_ended_ = true;
    }
    changed_.notify_all();
  }
  if (!ok) return;
  incoming_.Clear();
  StartRead(&incoming_);
}

void AppendConnection::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = nullptr;
  // The pending reads then fail too, and OnDone reports the status.
  if (!ok) write_failed_ = true;
  changed_.notify_all();
}

void AppendConnection::OnDone(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  status_ = status;
  done_ = true;
  changed_.notify_all();
}

}  // namespace hulld
