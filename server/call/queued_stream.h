#ifndef HULLD_SERVER_CALL_QUEUED_STREAM_H_
#define HULLD_SERVER_CALL_QUEUED_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

#include "server/call/call_stream.h"

namespace hulld::server {

// A stream that queues its replies. Any thread may add replies; they are written one at a time, in
// order. One mutex guards the state. Reads, writes, and the end of the call are started with the
// mutex held; gRPC calls back without it.
//
// The stream ends once its final status is set, all earlier replies are written, and no work is in
// flight. If the client disconnects or is revoked, the stream ends without sending the queued
// replies.
template <typename Reactor, typename Reply>
class QueuedStream : public CallStream<Reactor> {
 protected:
  using CallStream<Reactor>::CallStream;

  // Runs `step` under the mutex, then starts any operations that are now possible.
  template <typename Step>
  void Locked(Step&& step) {
    const auto self = this->shared_from_this();
    const std::lock_guard lock(mutex_);
    step();
    Proceed();
  }

  template <typename Step>
  void React(Step&& step) {
    Locked(std::forward<Step>(step));
  }

  void Open() override {
    Locked([] {});
  }
  void OnRevoked() override {
    Locked([this] { Abandon(); });
  }

  // The functions below require the mutex: call them in steps of Locked.

  // Starts work (reads or tasks) as the state permits. Called after each Locked step until the
  // final status is set. May queue replies and set the final status.
  virtual void StartWork() {}
  // Returns true if work is in flight that must finish before the stream ends.
  virtual bool IsWorking() const { return false; }
  // Returns true if the only queued reply must wait to be merged with later ones, which saves
  // writes. In that case, a Locked step must follow soon.
  virtual bool ShouldDelayWrite() { return false; }

  // Queues a reply. bytes: its size, if the stream bounds its queue.
  void Queue(Reply reply, size_t bytes = 0) {
    unsent_bytes_ += bytes;
    waiting_.push_back({std::move(reply), bytes, std::chrono::steady_clock::now()});
  }
  struct Waiting {
    Reply reply;
    size_t bytes;
    std::chrono::steady_clock::time_point since;
  };
  // The last queued reply, for merging more into it; null if the queue is empty.
  Waiting* LastWaiting() { return waiting_.empty() ? nullptr : &waiting_.back(); }
  // Adds to the size of the last queued reply.
  void GrowLastWaiting(size_t bytes) {
    HULLD_CHECK(!waiting_.empty());
    waiting_.back().bytes += bytes;
    unsent_bytes_ += bytes;
  }
  // Total size of the queued replies and of the one being written.
  size_t unsent_bytes() const { return unsent_bytes_; }

  // Sets the final status unless it is set already.
  void End(const absl::Status& status) {
    if (!end_.has_value()) end_ = status;
  }
  // Replaces the final status with a more specific one.
  void OverrideEnd(const absl::Status& status) { end_ = status; }
  const std::optional<absl::Status>& end() const { return end_; }

 private:
  void OnWriteDone(bool ok) final {
    Locked([this, ok] {
      HULLD_CHECK(std::exchange(writing_, false));
      unsent_bytes_ -= bytes_in_flight_;
      bytes_.Clear();
      if (!ok) Abandon();
    });
  }

  void OnCancel() final {
    Locked([this] { Abandon(); });
  }

  // Ends the call: the client stopped reading or was revoked.
  void Abandon() {
    this->call().Cancel();
    for (const Waiting& dropped : waiting_) unsent_bytes_ -= dropped.bytes;
    waiting_.clear();
    End(this->call().StopStatus());
  }

  void Proceed() {
    if (this->finished()) return;
    if (!end_.has_value()) StartWork();
    const bool is_alone = waiting_.size() == 1 && !end_.has_value();
    if (!writing_ && !waiting_.empty() && !(is_alone && ShouldDelayWrite())) {
      writing_ = true;
      bytes_ = SerializeReply(waiting_.front().reply);
      bytes_in_flight_ = waiting_.front().bytes;
      waiting_.pop_front();
      this->StartWrite(&bytes_);
    }
    if (end_.has_value() && !writing_ && !IsWorking()) this->FinishCall(*end_);
  }

  std::mutex mutex_;
  // The mutex guards the members below.
  std::deque<Waiting> waiting_;
  // The serialized reply in flight, and the size with which it was queued.
  Bytes bytes_;
  size_t bytes_in_flight_ = 0;
  size_t unsent_bytes_ = 0;
  bool writing_ = false;
  // Set when no more replies will be queued.
  std::optional<absl::Status> end_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_QUEUED_STREAM_H_
