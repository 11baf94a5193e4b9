#ifndef HULLD_CLIENT_WATCH_HULL_WATCH_H_
#define HULLD_CLIENT_WATCH_HULL_WATCH_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>

#include "client/calls/retry.h"
#include "hulld/v1/hull.grpc.pb.h"

namespace hulld {

// WatchHulls, message by message. After a lost connection, the watch resumes: it opens a new call
// after the last header's revision, and marks the end of the missed events with another `synced`.
// Code that accumulates the events need not handle lost connections. Next may be called by one
// thread, and Cancel by any thread.
class HullWatch {
 public:
  // Next connects. reconnect_timeout: limits the attempts to connect, and to reconnect to a lost
  // server. The first call and refused calls are retried as `retry` specifies.
  HullWatch(std::shared_ptr<v1::HullService::Stub> stub, v1::WatchHullsRequest request,
            RetryPolicy retry, std::chrono::milliseconds reconnect_timeout);
  // Cancels the watch.
  ~HullWatch();
  HullWatch(const HullWatch&) = delete;
  HullWatch& operator=(const HullWatch&) = delete;

  // Waits for the next message. An error ends the watch: CANCELLED after Cancel, or an error of the
  // contract.
  absl::StatusOr<v1::WatchHullsResponse> Next();

  // Makes the current and every later call of Next return promptly.
  void Cancel();

 private:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::WatchHullsResponse>> reader;
  };

  // Returns null after Cancel.
  Call* Open();
  absl::Status Close();

  const std::shared_ptr<v1::HullService::Stub> stub_;
  v1::WatchHullsRequest request_;
  const RetryPolicy retry_;
  const std::chrono::milliseconds reconnect_timeout_;
  // connected_: true if a message has arrived, so a server was reached. reported_: true if events
  // have arrived that a restart must revoke.
  bool connected_ = false;
  bool reported_ = false;

  std::mutex mutex_;
  // Guarded by the mutex where it changes.
  std::unique_ptr<Call> call_;
  bool cancelled_ = false;
  std::condition_variable cancellation_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_HULL_WATCH_H_
