#ifndef HULLD_CLIENT_WATCH_HULL_WATCH_H_
#define HULLD_CLIENT_WATCH_HULL_WATCH_H_

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <mutex>

#include "client/calls/retry.h"
#include "hulld/v1/hull.grpc.pb.h"

namespace hulld {

// WatchHulls, message by message. A watch whose connection is lost goes on where it was: it opens
// another call that resumes after the last header, which ends as `synced` once more. So code that
// folds the events needs to know nothing of connections. Next is for one thread, Cancel for any.
class HullWatch {
 public:
  // Connects in Next. patience: for how long to look for a server that was there before; the first
  // call, and one that the server refuses, fail as `retry` says.
  HullWatch(std::shared_ptr<v1::HullService::Stub> stub, v1::WatchHullsRequest request,
            RetryPolicy retry, std::chrono::milliseconds patience);
  // Cancels the watch.
  ~HullWatch();
  HullWatch(const HullWatch&) = delete;
  HullWatch& operator=(const HullWatch&) = delete;

  // Waits for the next message. An error ends the watch: CANCELLED after Cancel, and those of the
  // contract.
  absl::StatusOr<v1::WatchHullsResponse> Next();

  // Has Next return, now and ever after.
  void Cancel();

 private:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::WatchHullsResponse>> reader;
  };

  // Null once Cancel was called.
  Call* Open();
  absl::Status Close();

  const std::shared_ptr<v1::HullService::Stub> stub_;
  v1::WatchHullsRequest request_;
  const RetryPolicy retry_;
  const std::chrono::milliseconds patience_;
  // A message came, hence there is a server; events came, which a new start must take back.
  bool connected_ = false;
  bool told_ = false;

  std::mutex mutex_;
  // Guarded by the mutex where it changes.
  std::unique_ptr<Call> call_;
  bool cancelled_ = false;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_WATCH_HULL_WATCH_H_
