#ifndef HULLD_CLIENT_APPEND_CONNECTION_H_
#define HULLD_CLIENT_APPEND_CONNECTION_H_

#include <grpcpp/client_context.h>
#include <grpcpp/support/client_callback.h>

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>

#include "client/calls/retry.h"
#include "hulld/v1/hull.grpc.pb.h"

namespace hulld {

// One connection of AppendPoints, driven by one thread that never blocks longer than it asks to.
//
// gRPC calls On...Done from its own threads; they only record what happened and wake the driving
// thread. A hold keeps the call from being finished while the driving thread may still start
// writes.
class AppendConnection final
    : public grpc::ClientBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse> {
 public:
  explicit AppendConnection(v1::HullService::Stub* stub);
  // Cancels the call unless it has ended, and waits for gRPC to let go of it.
  ~AppendConnection() override;

  // True when Write may be called.
  bool writable();
  // Sends `request`, which is kept until gRPC is done with it. Requires that no write is under way
  // (checked), as writable() says.
  void Write(std::shared_ptr<const v1::AppendPointsRequest> request);
  void WritesDone();

  // The oldest response not yet taken.
  bool TakeResponse(v1::AppendPointsResponse* response);

  // Waits for a response, room to write (when `to_write`) or the end of the stream. False at the
  // deadline.
  bool WaitForEvent(bool to_write, Deadline deadline);

  // True when no further response will come; responses not yet taken are still there.
  bool ended();
  // The final status. Requires ended() (checked).
  grpc::Status Close();
  // Holds what the server sent beside the status. Requires that Close returned (checked).
  const grpc::ClientContext& context();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

 private:
  void ReleaseHold();

  grpc::ClientContext context_;
  v1::AppendPointsResponse incoming_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<v1::AppendPointsResponse> responses_;
  std::shared_ptr<const v1::AppendPointsRequest> writing_;
  bool write_failed_ = false;
  bool reads_ended_ = false;
  bool done_ = false;
  bool held_ = true;
  grpc::Status status_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_APPEND_CONNECTION_H_
