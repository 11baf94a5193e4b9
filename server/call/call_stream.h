#ifndef HULLD_SERVER_CALL_CALL_STREAM_H_
#define HULLD_SERVER_CALL_CALL_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "server/call/admission.h"
#include "server/call/call.h"
#include "server/call/message_bytes.h"
#include "server/contract/rpc.h"

namespace hulld::server {

// Base class of streaming calls: PulledStream creates each reply after the previous one is written,
// QueuedStream queues replies. Reactor: a reactor of message_bytes.h.
//
// A call owns itself until gRPC releases it. It does nothing before it is admitted, and finishes
// exactly once.
template <typename Reactor>
class CallStream : public Reactor, public std::enable_shared_from_this<CallStream<Reactor>> {
 public:
  // Admits the call of a new stream and opens it; a refused call ends immediately.
  static Reactor* Launch(const std::shared_ptr<CallStream>& stream) {
    stream->self_ = stream;
    absl::Status begun = stream->call_.Begin([weak = std::weak_ptr<CallStream>(stream)] {
      const std::shared_ptr<CallStream> revoked = weak.lock();
      if (revoked != nullptr && revoked->opened_) revoked->OnRevoked();
    });
    if (begun.ok()) begun = stream->Receive();
    if (!begun.ok()) {
      stream->FinishCall(begun);
      return stream.get();
    }
    stream->Open();
    // A concurrent revocation either sees opened_ or is detected here.
    stream->opened_ = true;
    if (stream->call_.is_revoked()) stream->OnRevoked();
    return stream.get();
  }

 protected:
  CallStream(CallContext& context, Admission& admission, Rpc rpc)
      : call_(context, admission, rpc) {}
  // No reaction or task is in flight, because each holds a reference.
  ~CallStream() override { HULLD_CHECK(finished_); }

  Call& call() { return call_; }
  const Call& call() const { return call_; }

  // Parses the request if it arrives with the call.
  virtual absl::Status Receive() { return absl::OkStatus(); }
  // Starts the work of the call. Runs on a gRPC thread, so it must neither block nor compute for
  // long.
  virtual void Open() = 0;
  // Ends the call after its token was revoked, if it waits for an event that may never come. Steps
  // that compute or write notice the revocation themselves. Called on any thread, possibly twice,
  // and possibly after the call has finished.
  virtual void OnRevoked() {}

  // Runs `step` on a pool or lane, and keeps this object alive until it returns.
  template <typename Pool, typename Step>
  void RunOn(Pool& pool, Step step) {
    pool.Submit([self = this->shared_from_this(), step = std::move(step)]() mutable { step(); },
                call_.client());
  }

  // Runs a gRPC reaction, and keeps this object alive until it returns.
  template <typename Step>
  void React(Step&& step) {
    const auto self = this->shared_from_this();
    step();
  }

  // Returns the reason why the call stopped, if it stopped; otherwise `status`.
  absl::Status OrStopped(const absl::Status& status) const {
    return call_.ShouldStop() ? call_.StopStatus() : status;
  }

  // Ends the call. Must be called exactly once, with no gRPC operation in flight except a read.
  void FinishCall(const absl::Status& status) {
    HULLD_CHECK(!std::exchange(finished_, true));
    this->Finish(call_.End(status));
  }
  bool finished() const { return finished_; }

  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { self_.reset(); }

 private:
  // Destroyed last, because its ticket keeps the server alive.
  Call call_;
  std::atomic<bool> opened_ = false;
  bool finished_ = false;
  // Keeps this object alive until gRPC releases it.
  std::shared_ptr<CallStream> self_;
};

// A stream that answers one request. Stream: a CallStream with a writing reactor.
template <typename Stream, typename Request>
class RequestStream : public Stream {
 protected:
  // bytes: the request, moved out of the buffer that gRPC holds until the call ends. args: passed
  // to the constructor of Stream.
  template <typename... Args>
  explicit RequestStream(const Bytes& bytes, Args&&... args)
      : Stream(std::forward<Args>(args)...), bytes_(StealBytes(bytes)) {}

  // Requires that the call was admitted.
  const Request& request() const { return request_; }
  // The request, from which the call may move parts. Their memory remains counted until the call
  // ends.
  Request& mutable_request() { return request_; }

 private:
  absl::Status Receive() final {
    return ParseRequest(bytes_, this->call().request_memory(), &request_, share_);
  }

  Bytes bytes_;
  RequestMemory::Share share_;
  Request request_;
};

// Reads messages into the same request object, one after the other. Stream: a CallStream with a
// reading reactor.
template <typename Stream, typename Request>
class ReadingStream : public Stream {
 protected:
  using Stream::Stream;

  // Starts reading the next message. Requires: no read is in flight, and the call has not finished.
  // A call with a revoked token ends instead.
  void Read() {
    if (!BeginRead()) OnNoMessage(absl::OkStatus());
  }
  bool reading() const { return reading_; }
  // The last message read. Requires that no read is in flight.
  Request& request() {
    HULLD_DCHECK(!reading_);
    return request_;
  }
  const Request& request() const {
    HULLD_DCHECK(!reading_);
    return request_;
  }

  // Called after a successful read, within Stream::React.
  virtual void OnMessage() = 0;
  // Called after the last message. OK: the client half-closed, disconnected, or was revoked.
  // Otherwise, the error of ParseRequest for the last message.
  virtual void OnNoMessage(const absl::Status& why) = 0;

 private:
  // Maximum memory, in bytes, that a request may retain uncounted while the next one is awaited.
  static constexpr uint64_t kKeptBytes = 64 << 10;

  bool BeginRead() {
    const std::lock_guard lock(read_mutex_);
    if (this->call().is_revoked()) return false;
    HULLD_CHECK(!std::exchange(reading_, true) && !this->finished());
    if (share_.bytes() > kKeptBytes) request_ = Request();
    share_.Release();
    this->StartRead(&bytes_);
    return true;
  }
  // Returns true if a read was in flight.
  bool EndRead() {
    const std::lock_guard lock(read_mutex_);
    return std::exchange(reading_, false);
  }

  // Drops a message that gRPC is still reading.
  void OnRevoked() final {
    Stream::OnRevoked();
    if (EndRead()) this->React([this] { OnNoMessage(absl::OkStatus()); });
  }

  void OnReadDone(bool ok) final {
    absl::Status parsed;
    if (ok) {
      parsed = ParseRequest(bytes_, this->call().request_memory(), &request_, share_);
    }
    this->React([this, ok, &parsed] {
      if (!EndRead()) return;
      if (ok && parsed.ok()) {
        OnMessage();
      } else {
        OnNoMessage(parsed);
      }
    });
  }

  // Buffer of gRPC's read.
  Bytes bytes_;
  RequestMemory::Share share_;
  Request request_;
  // Guards `reading_`: a revocation ends a read from another thread.
  std::mutex read_mutex_;
  bool reading_ = false;
};

// A stream with pulled replies: each is created after the previous one was written, so a slow
// client costs the memory of a single message. Only one operation is in flight at a time: a read, a
// task, or a write. Only this operation accesses the state, so no mutex is needed. A revocation
// ends a read in flight.
template <typename Reactor, typename Reply>
class PulledStream : public CallStream<Reactor> {
 protected:
  using CallStream<Reactor>::CallStream;

  // The reply being created or sent.
  Reply& reply() { return reply_; }

  // Sends the reply. Requires that nothing else is in flight.
  void Send() {
    HULLD_CHECK(!std::exchange(writing_, true));
    bytes_ = SerializeReply(reply_);
    this->StartWrite(&bytes_);
  }

  // Called after the reply was written. Clears it, which retains its memory for reuse, and then
  // creates the next reply, reads the next message, or ends the call.
  virtual void OnSent() = 0;

 private:
  void OnWriteDone(bool ok) final {
    this->React([this, ok] {
      HULLD_CHECK(std::exchange(writing_, false));
      bytes_.Clear();
      if (this->call().ShouldStop()) return this->FinishCall(this->call().StopStatus());
      if (!ok) return this->FinishCall(absl::CancelledError("the client disconnected"));
      OnSent();
    });
  }

  Reply reply_;
  // The serialized reply in flight.
  Bytes bytes_;
  bool writing_ = false;
};

// A stream that queues its replies. Any thread may add replies; they are written one by one, in
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

#endif  // HULLD_SERVER_CALL_CALL_STREAM_H_
