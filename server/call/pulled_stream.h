#ifndef HULLD_SERVER_CALL_PULLED_STREAM_H_
#define HULLD_SERVER_CALL_PULLED_STREAM_H_

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/call/call_stream.h"

namespace hulld::server {

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

}  // namespace hulld::server

#endif  // HULLD_SERVER_CALL_PULLED_STREAM_H_
