#ifndef HULLD_SERVER_CALL_QUEUED_STREAM_H_
#define HULLD_SERVER_CALL_QUEUED_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "server/call/call_stream.h"

namespace hulld::server {

// A stream whose replies are queued: they are made by any thread and written one at a time, in the
// order of the queue. One mutex guards the state; reads, writes and the end are started under it,
// and gRPC calls back without it.
//
// The stream ends once an end is set, the replies before are written, and no work is under way. A
// client that is gone, or is no longer let in, ends it without the replies that wait.
template <typename Reactor, typename Reply>
class QueuedStream : public CallStream<Reactor> {
 protected:
  using CallStream<Reactor>::CallStream;

  // Runs `step` under the mutex, then starts what may start by then.
  template <typename Step>
  void Locked(Step&& step) {
    const auto self = this->shared_from_this();
    const std::lock_guard lock(mutex_);
    holder_ = std::this_thread::get_id();
    step();
    Proceed();
    holder_ = std::thread::id();
  }

  template <typename Step>
  void React(Step&& step) {
    Locked(std::forward<Step>(step));
  }

  static constexpr bool kIsLocked = true;
  void OnRevoked() override {
    Locked([this] { Abandon(); });
  }

  // The rest requires the mutex, so is for steps of Locked.

  // Starts work, reads or tasks, as the state permits; called after each Locked step until an end
  // is set. May queue replies and set the end.
  virtual void StartWork() = 0;
  // Whether something is under way that must be over before the stream ends.
  virtual bool IsWorking() const = 0;
  // Whether the only reply that waits is to wait longer, so that others join it, which saves
  // writes. Requires, if true, that a Locked step follows soon.
  virtual bool KeepsWaiting() const { return false; }

  // Queues a reply. bytes: its size, where the stream bounds what waits.
  void Queue(Reply reply, size_t bytes = 0) {
    CheckLocked();
    unsent_bytes_ += bytes;
    waiting_.push_back({std::move(reply), bytes, std::chrono::steady_clock::now()});
  }
  // The last reply while it waits, so that more may be added to it; null when none waits.
  Reply* LastWaiting() { return waiting_.empty() ? nullptr : &waiting_.back().reply; }
  size_t LastWaitingBytes() const { return waiting_.empty() ? 0 : waiting_.back().bytes; }
  // Notes what was added to the last waiting reply.
  void GrowLastWaiting(size_t bytes) {
    HULLD_CHECK(!waiting_.empty());
    waiting_.back().bytes += bytes;
    unsent_bytes_ += bytes;
  }
  // For how long it waits.
  std::chrono::steady_clock::duration LastWaitingTime() const {
    return std::chrono::steady_clock::now() - waiting_.back().since;
  }
  void DropWaiting() {
    CheckLocked();
    for (const Waiting& dropped : waiting_) unsent_bytes_ -= dropped.bytes;
    waiting_.clear();
  }
  // The size of the replies that wait and of the one that is being written.
  size_t unsent_bytes() const { return unsent_bytes_; }

  // Sets the end, unless one is set.
  void End(const absl::Status& status) {
    CheckLocked();
    if (!end_.has_value()) end_ = status;
  }
  // Sets an end that tells more than the one that is set.
  void EndInsteadWith(const absl::Status& status) {
    CheckLocked();
    end_ = status;
  }
  const std::optional<absl::Status>& end() const { return end_; }

 private:
  struct Waiting {
    Reply reply;
    size_t bytes;
    std::chrono::steady_clock::time_point since;
  };

  void CheckLocked() const { HULLD_DCHECK(holder_ == std::this_thread::get_id()); }

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

  // The client reads no more, or is no longer let in.
  void Abandon() {
    this->call().Cancel();
    DropWaiting();
    End(this->call().StopStatus());
  }

  void Proceed() {
    if (this->finished()) return;
    if (!end_.has_value()) StartWork();
    const bool is_alone = waiting_.size() == 1 && !end_.has_value();
    if (!writing_ && !waiting_.empty() && !(is_alone && KeepsWaiting())) {
      writing_ = true;
      bytes_ = SerializeReply(waiting_.front().reply);
      bytes_in_flight_ = waiting_.front().bytes;
      waiting_.pop_front();
      this->StartWrite(&bytes_);
    }
    if (end_.has_value() && !writing_ && !IsWorking()) this->FinishCall(*end_);
  }

  std::mutex mutex_;
  std::atomic<std::thread::id> holder_ = std::thread::id();
  // The rest is guarded by the mutex.
  std::deque<Waiting> waiting_;
  // The reply that is being written, as gRPC sends it, and the size that it was queued with.
  grpc::ByteBuffer bytes_;
  size_t bytes_in_flight_ = 0;
  size_t unsent_bytes_ = 0;
  bool writing_ = false;
  // Set once nothing more is to come.
  std::optional<absl::Status> end_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_QUEUED_STREAM_H_
