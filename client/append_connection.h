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

// An AppendPoints stream, driven by a single thread that never blocks past its deadline.
//
// gRPC calls the On...Done functions on its own threads. They only record the event and wake the
// driving thread. A hold keeps the call open while the driving thread may still start writes.
class AppendConnection final
    : public grpc::ClientBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse> {
 public:
  explicit AppendConnection(v1::HullService::Stub* stub);
  // Cancels the call unless it has ended, and waits until gRPC releases it.
  ~AppendConnection() override;

  // Returns true if Write may be called.
  bool writable();
  // Sends `request`, and keeps it until gRPC has written it. Requires writable(): no write is in
  // flight (checked).
  void Write(std::shared_ptr<const v1::AppendPointsRequest> request);
  void WritesDone();

  // Removes the oldest pending response. Returns false if there is none.
  bool TakeResponse(v1::AppendPointsResponse* response);

  // Waits for a response, for the end of the stream, or, if `to_write`, until a write is possible.
  // Returns false at the deadline.
  bool WaitForEvent(bool to_write, Deadline deadline);

  // Returns true if no further response will arrive; pending responses remain available.
  bool ended();
  // Returns the final status. Requires ended() (checked).
  grpc::Status Close();
  // Returns the context with the server's trailing metadata. Requires that Close has returned
  // (checked).
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
