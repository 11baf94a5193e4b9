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
  // Writer ID. If empty, a random ID is used.
  std::string writer_id;
  bool create_if_absent = false;
  // Limits on the chunks in flight, which are kept in memory for resending. Append waits while
  // either limit is reached.
  size_t max_in_flight_bytes = size_t{8} << 20;
  size_t max_in_flight_chunks = 64;
};

struct AppendTotals {
  uint64_t chunks_sent = 0;
  uint64_t points_sent = 0;
  uint64_t points_acknowledged = 0;
  // Chunks that were committed but not acknowledged when a connection was lost. `counts` does not
  // include them.
  uint64_t chunks_recovered = 0;
  uint64_t reconnects = 0;
  // Sums over the acknowledgements received.
  v1::PointCounts counts;
  // The last acknowledgement. Empty if none has arrived.
  v1::AppendAck last_ack;
  uint64_t hull_revision = 0;
  uint64_t vertex_count = 0;
};

// A pipelined stream of chunks into a hull, with a bounded number of chunks in flight. If the
// connection breaks, or the server ends the stream with a retry hint, the appender reconnects as
// the same writer, reads the last committed sequence, and resends the missing chunks. Each chunk is
// applied exactly once. The appender fails if the hull or the store was replaced, because
// acknowledged points would be missing.
//
// Not thread-safe. The destructor cancels chunks in flight.
class Appender {
 public:
  ~Appender();
  Appender(const Appender&) = delete;
  Appender& operator=(const Appender&) = delete;

  // The server's first reply on the first connection.
  const v1::AppendOpened& opened() const { return opened_; }
  const std::string& writer_id() const { return open_.writer_id(); }

  // Queues a chunk with the writer's next sequence number. Waits while too much is in flight. An
  // error, which may concern an earlier chunk, ends the stream and is returned by every later call.
  absl::Status Append(v1::PointBlock points);

  // Waits until every chunk is acknowledged, then ends the stream.
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
  // Sends and receives until at most `chunks` and `bytes` are in flight.
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
  // Number of chunks of unacknowledged_ written to the current connection.
  size_t written_ = 0;
  // Number of connections lost since the last acknowledgement, and the time at which to stop
  // reconnecting: timeout_ after the first loss.
  int failures_ = 0;
  Deadline give_up_at_;
  absl::Status failed_;
  AppendTotals totals_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_APPENDER_H_
