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

// The number of the last batch that was committed.
absl::StatusOr<uint64_t> LastBatch(Session& session);

// How the servers over one database tell each other that there is a new batch (LISTEN and NOTIFY).
// A notice is a hint and holds no more than the number of a batch: a server that hears it looks at
// the store, a server that does not hear it looks there now and then, and nothing depends on its
// arrival.
//
// A notice is sent after the commit, in a transaction of its own that waits for no disk, and
// notices that would follow each other within kLeastPause are one. NOTIFY within the transaction of
// the batch would save the sending, but PostgreSQL holds a lock of the whole cluster from before
// such a commit until its log is on disk, here and on synchronous standbys. The batches of one
// store take turns anyway. But 8 writers that share nothing but the cluster, as those of 8 stores
// do, went from 1460 commits a second to 430, and with notices after each commit, not put together,
// to 1090 (observed: means of 2 runs of pgbench 15, 3 listeners, 2 cores, load 7).
//
// One session, and a thread that both listens and sends. A session that is lost is opened again
// after `retry`; a database that refuses to listen, as one that only speaks PostgreSQL's protocol
// may, is asked again every minute.
class BatchNotices {
 public:
  using Opener = std::function<absl::StatusOr<std::unique_ptr<Session>>()>;

  static constexpr std::chrono::milliseconds kLeastPause{2};

  // open: makes the session. on_batch: told, on the thread, the number of a batch that somebody
  // committed, ourselves included, and of the last one whenever listening begins. fallback: what
  // the log says is done without notices.
  BatchNotices(Opener open, std::chrono::milliseconds retry,
               std::function<void(uint64_t batch)> on_batch, std::string fallback);
  BatchNotices(const BatchNotices&) = delete;
  BatchNotices& operator=(const BatchNotices&) = delete;
  ~BatchNotices();

  // Tells all servers soon that this batch is committed. Any thread. Cost: a system call.
  void Send(uint64_t batch);

  // Whether the session is there, as far as is known, and the last batch that was heard of.
  bool is_listening() const { return is_listening_; }
  uint64_t last_heard() const { return last_heard_; }

 private:
  void Run();
  absl::Status Serve();
  void Hear(uint64_t batch);
  void AwaitRetry(std::chrono::milliseconds pause) const;
  void ClearWake() const;

  const Opener open_;
  const std::chrono::milliseconds retry_;
  const std::function<void(uint64_t batch)> on_batch_;
  const std::string fallback_;
  // An eventfd: can be read when there is something to send, or the end has come.
  const int wake_;
  std::atomic<bool> ending_ = false;
  // The last batch to be sent.
  std::atomic<uint64_t> to_send_ = 0;
  std::atomic<bool> is_listening_ = false;
  std::atomic<uint64_t> last_heard_ = 0;
  // The thread's own: the last batch that was sent.
  uint64_t sent_ = 0;
  std::thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_POSTGRES_BATCH_NOTICES_H_
