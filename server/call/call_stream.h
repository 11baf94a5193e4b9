#ifndef HULLD_SERVER_CALL_CALL_STREAM_H_
#define HULLD_SERVER_CALL_CALL_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>

#include "core/base/check.h"
#include "server/call/admission.h"
#include "server/call/call.h"
#include "server/call/message_bytes.h"
#include "server/call/request_memory.h"
#include "server/contract/rpc.h"

namespace hulld::server {

// gRPC's reactors for the kinds of streams. They are streams of bytes, as message_bytes.h says.
using ReadReactor = grpc::ServerReadReactor<grpc::ByteBuffer>;
using WriteReactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;
using BidiReactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

// What every streaming call has: it owns itself until gRPC is done with it, is admitted before
// anything else, and finishes exactly once. Reactor: one of those above.
//
// PulledStream and QueuedStream build on this: replies made one at a time, or queued.
template <typename Reactor>
class CallStream : public Reactor, public std::enable_shared_from_this<CallStream<Reactor>> {
 public:
  // Admits the call of a new stream and opens it; a call that is not admitted ends at once.
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
    // One of the two sees what the other did.
    stream->opened_ = true;
    if (stream->call_.is_revoked()) stream->OnRevoked();
    return stream.get();
  }

 protected:
  CallStream(grpc::CallbackServerContext& context, Admission& admission, Rpc rpc)
      : call_(context, admission, rpc) {}
  // Under way are neither a reaction nor a task: each holds a reference.
  ~CallStream() override { HULLD_CHECK(finished_); }

  Call& call() { return call_; }
  const Call& call() const { return call_; }

  // Parses the request, where the client sends one that comes with the call.
  virtual absl::Status Receive() { return absl::OkStatus(); }
  // Starts the first step, on gRPC's thread: neither waits nor computes for long.
  virtual void Open() = 0;
  // The token is no longer valid: ends the call if it waits for something that may never come.
  // What computes or writes sees by itself that it should stop. On any thread, perhaps twice, and
  // perhaps when the call has finished.
  virtual void OnRevoked() {}

  // Runs `step` on a pool or lane, which keeps this alive until then.
  template <typename Pool, typename Step>
  void RunOn(Pool& pool, Step step) {
    pool.Submit([self = this->shared_from_this(), step = std::move(step)]() mutable { step(); },
                call_.client());
  }

  // Runs a reaction of gRPC's, which keeps this alive until it returns.
  template <typename Step>
  void React(Step&& step) {
    const auto self = this->shared_from_this();
    step();
  }

  // Why the call stopped, if it did; otherwise `status`.
  absl::Status OrStopped(const absl::Status& status) const {
    return call_.ShouldStop() ? call_.StopStatus() : status;
  }

  // Ends the call, exactly once. No other operation of gRPC's may be under way but a read.
  void FinishCall(const absl::Status& status) {
    HULLD_CHECK(!std::exchange(finished_, true));
    // What stopped the work is better known here than where it was noticed.
    this->Finish(call_.End(absl::IsCancelled(status) ? OrStopped(status) : status));
  }
  bool finished() const { return finished_; }

  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { self_.reset(); }

  // Whether one mutex guards all that several threads touch.
  static constexpr bool kIsLocked = false;

 private:
  // Destroyed last: its ticket keeps the server alive.
  Call call_;
  std::atomic<bool> opened_ = false;
  bool finished_ = false;
  // Keeps this alive until gRPC is done with it.
  std::shared_ptr<CallStream> self_;
};

// A stream that answers one request. Stream: a CallStream whose reactor writes.
template <typename Stream, typename Request>
class RequestStream : public Stream {
 protected:
  // bytes: the request as gRPC holds it until the call ends; taken from there. args: for Stream.
  template <typename... Args>
  explicit RequestStream(const grpc::ByteBuffer& bytes, Args&&... args)
      : Stream(std::forward<Args>(args)...), bytes_(TakenFrom(bytes)) {}

  // Requires that the call was let in.
  const Request& request() const { return request_; }
  // To take a part of it, which stays counted until the call ends.
  Request& own_request() { return request_; }

 private:
  absl::Status Receive() final {
    return ParseRequest(bytes_, this->call().request_memory(), &request_, share_);
  }

  grpc::ByteBuffer bytes_;
  RequestMemory::Share share_;
  Request request_;
};

// Reads messages into one request, one at a time. Stream: a CallStream whose reactor reads.
template <typename Stream, typename Request>
class ReadingStream : public Stream {
 protected:
  using Stream::Stream;

  // Starts to read the next message. Requires that none is being read, and that the call has not
  // finished. A call whose token is no longer valid ends instead.
  void Read() {
    if (!BeginRead()) OnNoMessage(absl::OkStatus());
  }
  bool reading() const { return reading_; }
  // The message that was read. Requires that none is being read.
  Request& request() {
    HULLD_DCHECK(!reading_);
    return request_;
  }
  const Request& request() const {
    HULLD_DCHECK(!reading_);
    return request_;
  }

  // What follows a read, as Stream::React runs it.
  virtual void OnMessage() = 0;
  // OK: the client has said all, or is gone, or is no longer let in. Otherwise as ParseRequest says
  // of its last message.
  virtual void OnNoMessage(const absl::Status& why) = 0;

 private:
  // What a request may hold on to while the next one is awaited, uncounted.
  static constexpr uint64_t kKeptBytes = 64 << 10;

  bool BeginRead() {
    const auto lock = LockRead();
    if (!Stream::kIsLocked && this->call().is_revoked()) return false;
    HULLD_CHECK(!std::exchange(reading_, true) && !this->finished());
    if (share_.bytes() > kKeptBytes) request_ = Request();
    share_.GiveBack();
    this->StartRead(&bytes_);
    return true;
  }
  // Whether a message was awaited until now.
  bool EndRead() {
    const auto lock = LockRead();
    return std::exchange(reading_, false);
  }
  std::unique_lock<std::mutex> LockRead() {
    return Stream::kIsLocked ? std::unique_lock<std::mutex>() : std::unique_lock(read_mutex_);
  }

  void OnRevoked() final {
    if constexpr (Stream::kIsLocked) {
      Stream::OnRevoked();
    } else if (EndRead()) {
      // Nothing else is under way: what gRPC still reads is dropped.
      this->React([this] { OnNoMessage(absl::OkStatus()); });
    }
  }

  void OnReadDone(bool ok) final {
    if (!Stream::kIsLocked && !EndRead()) return;
    absl::Status parsed;
    if (ok) {
      parsed = ParseRequest(bytes_, this->call().request_memory(), &request_, share_);
    }
    this->React([this, ok, &parsed] {
      if constexpr (Stream::kIsLocked) HULLD_CHECK(EndRead());
      if (ok && parsed.ok()) {
        OnMessage();
      } else {
        OnNoMessage(parsed);
      }
    });
  }

  // What gRPC reads into.
  grpc::ByteBuffer bytes_;
  RequestMemory::Share share_;
  Request request_;
  // Guards `reading_` where no mutex of the stream does: a revocation ends a read from another
  // thread.
  std::mutex read_mutex_;
  bool reading_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_CALL_STREAM_H_
