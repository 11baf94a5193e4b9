#ifndef HULLD_SERVER_CALL_PULLED_STREAM_H_
#define HULLD_SERVER_CALL_PULLED_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/call/call_stream.h"

namespace hulld::server {

// A stream whose replies are pulled: each is made when the one before was written, so a client that
// reads slowly costs one message of memory. One thing at a time is under way: a read, a task or a
// write. Nothing else touches the state, so it needs no mutex. A revocation takes the place of a
// read that is under way.
template <typename Reactor, typename Reply>
class PulledStream : public CallStream<Reactor> {
 protected:
  using CallStream<Reactor>::CallStream;

  // The reply that is being made or sent.
  Reply& reply() { return reply_; }

  // Sends the reply. Requires that nothing else is under way.
  void Send() {
    HULLD_CHECK(!std::exchange(writing_, true));
    bytes_ = SerializeReply(reply_);
    this->StartWrite(&bytes_);
  }

  // The reply was written, and is still there, so that its memory can be used again: clears it, and
  // makes the next one, reads on, or ends.
  virtual void OnSent() = 0;

 private:
  void OnWriteDone(bool ok) final {
    this->React([this, ok] {
      HULLD_CHECK(std::exchange(writing_, false));
      bytes_.Clear();
      if (this->call().ShouldStop()) return this->FinishCall(this->call().StopStatus());
      if (!ok) return this->FinishCall(absl::CancelledError("the client is gone"));
      OnSent();
    });
  }

  Reply reply_;
  // The reply as gRPC sends it.
  grpc::ByteBuffer bytes_;
  bool writing_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_PULLED_STREAM_H_
