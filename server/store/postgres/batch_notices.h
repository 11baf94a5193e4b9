#ifndef HULLD_SERVER_STORE_POSTGRES_BATCH_NOTICES_H_
#define HULLD_SERVER_STORE_POSTGRES_BATCH_NOTICES_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "server/store/postgres/session.h"

namespace hulld::server {

// Returns the number of the last committed batch.
absl::StatusOr<uint64_t> LastBatch(Session& session);

// Notifications of new batches between the servers of a database (LISTEN and NOTIFY). A notice is
// only a hint, and carries just the number of a batch. A server that receives it queries the store;
// a server that misses it finds the batch by polling. Correctness does not depend on notices.
//
// A notice is sent after the commit, in a separate transaction that does not wait for the disk, and
// notices within kMinPause are merged. NOTIFY within the transaction of the batch would save the
// extra send, but PostgreSQL then holds a cluster-wide lock from before the commit until its log is
// on disk, here and on synchronous standbys. Within a store this makes no difference, because its
// batches are serialized anyway. But with 8 writers that share only the cluster, such as 8 stores,
// throughput dropped from 1460 commits per second to 430. One unmerged notice after each commit
// lowered it to 1090 (**observed**: means of 2 runs of pgbench 15, 3 listeners, 2 cores, load 7).
//
// Uses one session, and a thread that listens and sends. A lost session is reopened after `retry`;
// a database that refuses to listen, as some implementations of PostgreSQL's protocol do, is
// retried every minute.
class BatchNotices {
 public:
  using Opener = std::function<absl::StatusOr<std::unique_ptr<Session>>()>;

  static constexpr std::chrono::milliseconds kMinPause{2};

  // open: creates the session. on_batch: receives, on the thread, the number of each committed
  // batch, including this server's, and the last one whenever listening begins. fallback: log text
  // that describes the behavior without notices.
  BatchNotices(Opener open, std::chrono::milliseconds retry,
               std::function<void(uint64_t batch)> on_batch, std::string fallback);
  BatchNotices(const BatchNotices&) = delete;
  BatchNotices& operator=(const BatchNotices&) = delete;
  ~BatchNotices();

  // Schedules a notice of this committed batch to all servers. Any thread. Cost: a system call.
  void Send(uint64_t batch);

  // is_listening: true if the session exists, as far as is known. last_received: the last batch
  // received.
  bool is_listening() const { return is_listening_; }
  uint64_t last_received() const { return last_received_; }

 private:
  void Run();
  absl::Status Serve();
  void NoteReceived(uint64_t batch);
  void AwaitRetry(std::chrono::milliseconds pause) const;
  void ClearWake() const;

  const Opener open_;
  const std::chrono::milliseconds retry_;
  const std::function<void(uint64_t batch)> on_batch_;
  const std::string fallback_;
  // An eventfd: readable if a notice is due or the thread must end.
  const int wake_;
  std::atomic<bool> ending_ = false;
  // The last batch to send.
  std::atomic<uint64_t> to_send_ = 0;
  std::atomic<bool> is_listening_ = false;
  std::atomic<uint64_t> last_received_ = 0;
  // Used only by the thread. The last batch sent.
  uint64_t sent_ = 0;
  std::thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_BATCH_NOTICES_H_
