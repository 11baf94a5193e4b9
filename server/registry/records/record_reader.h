#ifndef HULLD_SERVER_REGISTRY_RECORDS_RECORD_READER_H_
#define HULLD_SERVER_REGISTRY_RECORDS_RECORD_READER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/process/fair_queue.h"
#include "server/process/task_pool.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/peers/peer_sync.h"
#include "server/registry/state/registry_state.h"
#include "server/registry/watch/change_feed.h"
#include "server/store/store.h"

namespace hulld::server {

// Clients in fair scheduling of the threads that read the store, besides readers that load points:
// pending record reads, and reads for watches.
inline constexpr ClientId kRecordReader = {1};
inline constexpr ClientId kWatchReader = {2};

// Reads records from a store that supports record lookup, only some of which are in memory. Loads
// the record of an ID into the tables (its hull, its body, or the absence of both), and lists
// records page by page without adding them to the tables.
//
// Invariants:
//   - At most one thread reads the record of an ID, however many callers wait for it.
//   - Only unknown IDs are read, so no local change interferes: local changes require known IDs.
//     A change by a peer server replaces the read in progress (OnPeerChange).
//   - When the waiting callers resume, the record is in memory, or was there and has been
//     evicted again.
//     A caller therefore looks the ID up again, and may find it unknown once more.
//   - Records are used only after the registry has reached their revision. The store may be at a
//     later one; the changes in between, of peer servers or local ones, are then applied first. An
//     answer mixing both revisions would be inconsistent, and a caller that saw the later one could
//     be answered from the earlier one next.
//
// Guarded by the registry's mutex, which is released during store queries.
class RecordReader final : public PageSource {
 public:
  // All must outlive this. loaders: threads for reads without a blocked caller, and for watches.
  RecordReader(RegistryState& state, Committer& committer, PeerSync& peers, TaskPool& loaders)
      : state_(state), committer_(committer), peers_(peers), loaders_(loaders) {}
  RecordReader(const RecordReader&) = delete;
  RecordReader& operator=(const RecordReader&) = delete;

  // The state of an ID that a task requires. kLife: the ID is known, and no change of a body, and
  // no creation or end of a hull, is in flight. kQuiet: the ID is known, and nothing is in flight.
  enum class For { kLife, kQuiet };
  // Runs `task` once all changes that peer servers have committed so far are applied and the ID is
  // in that state. On an error, calls `refuse` without the mutex. The task may call `again` to wait
  // for the same conditions and run again.
  using Task = std::function<void(Locked& locked, const LockedTask& again)>;
  void WhenReady(const std::string& id, For need, Refusal refuse, Task task);

  // Blocks until the first ID is known; also reads up to kMaxLookupsPerHold pending IDs. Releases
  // the mutex. Returns the error of the read, or CANCELLED if should_stop, which may be empty,
  // returned true. OK: the ID was known at some time since. Requires at least one ID.
  absl::Status AwaitKnown(Locked& locked, std::span<const std::string* const> ids,
                          const std::function<bool()>& should_stop);
  // Loads unknown records from the store, so it must not run on a gRPC thread. Status: UNAVAILABLE:
  // the store cannot be read; CANCELLED: should_stop returned true; RESOURCE_EXHAUSTED: a read is
  // needed, and readers exceed their share of --memory-limit. Cost: O(log n) each, and one store
  // query per kMaxLookupsPerHold; the mutex is released in between. may_wait: as in ReadPlan.
  FoundBodies FindBodies(std::span<const std::string> ids,
                         const std::function<bool()>& should_stop = {}, bool may_wait = true);

  // Returns the error for an ID that FindBodies did not find. The message says so if a hull has it.
  absl::Status NoSuchBody(const std::string& id);

  // Ends the read of the ID, which a peer server changed; its tasks look the ID up again. Requires
  // the mutex.
  void OnPeerChange(const std::string& id);

  // Returns at most `page_size` hulls, or bodies, or both, with IDs that start with `prefix` and
  // follow `after` in byte order; a page of bodies may contain fewer even if more follow. If the
  // store supports record lookup, queries the store, and must not run on a gRPC thread.
  // UNAVAILABLE: the store cannot be read. CANCELLED: should_stop returned true.
  absl::StatusOr<RecordPage> List(std::string prefix, std::string after, size_t page_size,
                                  const std::function<bool()>& should_stop = {},
                                  RecordKinds kinds = {.hulls = true});

  void ReadPage(Locked& locked, PageRequest request,
                std::function<void(Locked&, absl::StatusOr<RecordPage>)> done) override;

 private:
  // A read of a record, and the callbacks of those that wait for it. They are called with the
  // registry's mutex held, and receive the error of the read.
  struct PendingRead {
    std::string id;
    std::vector<Committer::Barrier> waiting;
  };
  // Arguments of WhenReady.
  struct ReadyTask {
    std::string id;
    For need;
    Refusal refuse;
    Task task;
  };
  using PendingReads = std::vector<std::shared_ptr<PendingRead>>;
  // The result of a store query, while the registry catches up with it.
  using Found = std::shared_ptr<const absl::StatusOr<FoundRecords>>;

  // Returns the read of the record of an ID, and true if it is new.
  std::pair<std::shared_ptr<PendingRead>, bool> Join(const std::string& id);
  // Reads the record of an ID, then calls `done`, which must check again that the ID is known.
  // Requires: the ID is unknown.
  void WhenKnown(const std::string& id, Committer::Barrier done);
  absl::Status AwaitMissing(Locked& locked, std::span<const std::string> ids,
                            const std::function<bool()>& should_stop);
  void RunWhenReady(Locked& locked, const std::shared_ptr<const ReadyTask>& ready);
  void ReadDue();
  void ReadRecords(Locked& locked, const PendingReads& reads);
  void TakeRecords(Locked& locked, const PendingReads& reads, const Found& found,
                   const absl::Status& status);
  void TakeRecord(Locked& locked, const std::string& id, const FoundRecords& found);

  // Calls `take`, now or on the committer's thread, once the registry has reached the revision of
  // the records found, or with an error. queried_at: the registry's revision at the time of the
  // store query. UNAVAILABLE: the store was rolled back, or cannot report the changes in between.
  void WhenReached(Locked& locked, uint64_t queried_at, const Found& found,
                   Committer::Barrier take);
  bool IsBehind(const std::string& id, const absl::StatusOr<StoredHull>& stored) const;
  bool IsBehind(Locked& locked, const FoundRecords& found) const;

  // Queries the store for a page.
  Found Query(const PageRequest& request);
  HullChange Describe(const std::string& id, const absl::StatusOr<StoredHull>& stored) const;
  RecordPage Describe(Locked& locked, const FoundRecords& found) const;
  RecordPage CataloguedPage(const PageRequest& request) const;

  RegistryState& state_;
  Committer& committer_;
  PeerSync& peers_;
  TaskPool& loaders_;

  // Guarded by mutex_: the unfinished reads, by ID; the reads not yet taken by a thread; and the
  // number of reading threads.
  std::map<std::string, std::shared_ptr<PendingRead>> reads_;
  PendingReads due_;
  size_t threads_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_RECORDS_RECORD_READER_H_
