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
#include "server/process/synchronization.h"
#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/records/record_gate.h"
#include "server/store/store.h"

namespace hulld::server {

// Clients in fair scheduling of the threads that read the store, besides readers that load points:
// pending record reads, and reads for watches (RecordLister).
inline constexpr ClientId kRecordReader = 1;
inline constexpr ClientId kWatchReader = 2;

// Loads the records of IDs into the catalog if it is a cache of a store that finds records: the
// record of the hull or of the body, or the absence of both.
//
// Invariants:
//   - At most one thread reads the record of an ID, however many callers wait for it.
//   - Only unknown IDs are read, so no local change interferes: local changes require known IDs.
//     A change by a peer server replaces the read in progress (EndReadingOf).
//   - When the waiting callers resume, the record is in the catalog, or was and is evicted again.
//     A caller therefore looks the ID up again, and may find it unknown once more.
//
// Guarded by the registry's mutex, which is released during store queries.
class RecordReader {
 public:
  // All must outlive this. loaders: threads for reads without a blocked caller.
  RecordReader(Store& store, FairMutex& mutex, Catalog& catalog, MemoryBudget& memory,
               RecordGate& gate, WorkerPool& loaders)
      : store_(store),
        mutex_(mutex),
        catalog_(catalog),
        memory_(memory),
        gate_(gate),
        loaders_(loaders) {}
  RecordReader(const RecordReader&) = delete;
  RecordReader& operator=(const RecordReader&) = delete;

  // Reads the record of an ID, then runs `next`, which must check again that the ID is known; or
  // refuses, without the mutex. Requires: the ID is unknown.
  void WhenKnown(Locked& locked, const std::string& id, Refusal refuse, LockedTask next);

  // Blocks until the first ID is known; also reads up to kMostLookupsPerHold pending IDs. Releases
  // the mutex. Returns the error of the read, or CANCELLED if should_stop, which may be empty,
  // returned true. OK: the ID was known at some time since. Requires at least one ID.
  absl::Status AwaitKnown(Locked& locked, std::span<const std::string* const> ids,
                          const std::function<bool()>& should_stop);
  // As AwaitKnown for the unknown ones among `ids`, which must include the first.
  // RESOURCE_EXHAUSTED: readers exceed their share of --memory-limit.
  absl::Status AwaitMissing(Locked& locked, std::span<const std::string> ids,
                            const std::function<bool()>& should_stop);

  // Ends the read of an ID after a peer server's change of it was applied to the catalog. Returns
  // the waiting tasks, to be run after all peer changes are applied.
  std::vector<LockedTask> EndReadingOf(const std::string& id);

 private:
  struct Reading {
    std::string id;
    bool is_over = false;
    // Error of the read.
    absl::Status status;
    ConditionVariable over;
    std::vector<std::pair<Refusal, LockedTask>> waiting;
  };
  using Readings = std::vector<std::shared_ptr<Reading>>;

  void ReadDue();
  void ReadRecords(Locked& locked, const Readings& readings);
  void TakeRecords(Locked& locked, const Readings& readings,
                   const absl::StatusOr<FoundRecords>& found);
  void TakeRecord(Locked& locked, const std::string& id, const FoundRecords& found);
  void EndReading(Locked& locked, Reading& reading, const absl::Status& status);

  Store& store_;
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  RecordGate& gate_;
  WorkerPool& loaders_;

  // Guarded by mutex_: reads that are not over, by ID; the ones not yet taken by a thread; and the
  // number of reading threads.
  std::map<std::string, std::shared_ptr<Reading>> readings_;
  Readings due_;
  size_t threads_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_RECORDS_RECORD_READER_H_
