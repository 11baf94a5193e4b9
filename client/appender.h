#ifndef HULLD_CLIENT_APPENDER_H_
#define HULLD_CLIENT_APPENDER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "client/calls/retry.h"
#include "hulld/v1/hull.grpc.pb.h"

namespace hulld {

class AppendConnection;

struct AppendOptions {
  // Names the writer. Empty: a random name.
  std::string writer_id;
  bool create_if_absent = false;
  // Chunks sent but not acknowledged are kept for resending; Append waits while they reach either
  // bound.
  size_t max_in_flight_bytes = size_t{8} << 20;
  size_t max_in_flight_chunks = 64;
};

struct AppendTotals {
  uint64_t chunks_sent = 0;
  uint64_t points_sent = 0;
  uint64_t points_acknowledged = 0;
  // Chunks that the server had committed although their acknowledgement was lost with a connection:
  // `counts` lacks them.
  uint64_t chunks_recovered = 0;
  uint64_t reconnects = 0;
  // Sums over the acknowledgements received.
  v1::PointCounts counts;
  // The last acknowledgement; it has no fields before the first one.
  v1::AppendAck last_ack;
  uint64_t hull_revision = 0;
  uint64_t vertex_count = 0;
};

// A stream of chunks into one hull: pipelined, with a bounded number in flight. When the connection
// breaks, or the server ends the stream and says when to retry, it reconnects as the same writer,
// asks for the last committed sequence and resends what is missing, so that each chunk is applied
// once. It stops when the hull or the store is another one than before: what was acknowledged would
// be missing there.
//
// Only one thread may use it. Its destructor cancels what is not acknowledged.
class Appender {
 public:
  ~Appender();
  Appender(const Appender&) = delete;
  Appender& operator=(const Appender&) = delete;

  // The server's first answer on the first connection.
  const v1::AppendOpened& opened() const { return opened_; }
  const std::string& writer_id() const { return open_.writer_id(); }

  // Queues one chunk, numbered after the writer's last. Waits while too much is in flight. An
  // error is the stream's and may concern an earlier chunk; every further call returns it again.
  absl::Status Append(v1::PointBlock points);

  // Waits until every chunk is acknowledged, and ends the stream.
  absl::Status Finish();

  const AppendTotals& totals() const { return totals_; }

 private:
  friend class Client;

  struct Chunk {
    std::shared_ptr<const v1::AppendPointsRequest> request;
    size_t bytes = 0;
    uint64_t points = 0;
  };

  Appender(std::shared_ptr<v1::HullService::Stub> stub, v1::AppendOpen open, AppendOptions options,
           std::chrono::milliseconds timeout, RetryPolicy retry);

  absl::Status OpenFirst();
  // Opens a connection and waits for `opened`.
  absl::StatusOr<v1::AppendOpened> Connect();
  absl::Status Reconnect(absl::Status cause);
  absl::Status ResumeAfter(const v1::AppendOpened& opened);
  // Sends and receives until at most the given amounts are in flight.
  absl::Status PumpUntil(size_t chunks, size_t bytes);
  absl::Status TakeResponse(const v1::AppendPointsResponse& response);
  void DropAcknowledged(uint64_t sequence, bool recovered);
  absl::Status Fail(absl::Status status);

  std::shared_ptr<v1::HullService::Stub> stub_;
  v1::AppendOpen open_;
  AppendOptions options_;
  std::chrono::milliseconds timeout_;
  RetryPolicy retry_;

  std::unique_ptr<AppendConnection> connection_;
  v1::AppendOpened opened_;
  uint64_t next_sequence_ = 1;
  std::deque<Chunk> unacknowledged_;
  size_t bytes_in_flight_ = 0;
  // How many of unacknowledged_ were written to the present connection.
  size_t written_ = 0;
  // Connections lost since the last acknowledgement.
  int failures_ = 0;
  absl::Status failed_;
  AppendTotals totals_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_APPENDER_H_
