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

// What takes turns for the threads that read from the store, beside the readers that have points
// loaded: records that are due, and what watches are told next (RecordLister).
inline constexpr ClientId kRecordReader = 1;
inline constexpr ClientId kWatchReader = 2;

// Makes known what there is under an ID, where the store finds records and the catalog is a cache
// of them: reads the record of the hull or of the body, or that there is neither, into the catalog.
//
// Invariants:
//   - One thread at a time reads the record of an ID, whatever number of callers wait for it.
//   - What is read is of IDs that are not known, so none of our own changes comes in between:
//     those are of IDs that are known. What other servers did of an ID meanwhile takes the place of
//     what is being read of it (EndReadingOf).
//   - What was read is in the catalog when those that wait for it go on, or was and is dropped
//     again. So a caller looks again for the ID, and may find that it is not known once more.
//
// Guarded by the registry's mutex, which is released while the store is asked.
class RecordReader {
 public:
  // All must outlive this. loaders: threads that read what nobody waits for with a thread.
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

  // Has the record of an ID read, and goes on with `next`, which must look anew whether it is known
  // then; or refuses, without the mutex. Requires that the ID is not known.
  void WhenKnown(Locked& locked, const std::string& id, Refusal refuse, LockedTask next);

  // For a reader: makes the first ID known, and with it others, at most kMostLookupsPerHold, that
  // are due. Releases the mutex. Why it could not be read, or CANCELLED: should_stop, which may be
  // empty, said so. OK: it was known at some moment since. Requires an ID.
  absl::Status AwaitKnown(Locked& locked, std::span<const std::string* const> ids,
                          const std::function<bool()>& should_stop);
  // The same for those of these IDs that are not known, of which the first is one.
  // RESOURCE_EXHAUSTED: readers hold more than their share of --memory-limit.
  absl::Status AwaitMissing(Locked& locked, std::span<const std::string> ids,
                            const std::function<bool()>& should_stop);

  // What other servers did of an ID is in the catalog, in the place of what is being read of it.
  // Returns what waited for that, to go on once everything that they did is taken over.
  std::vector<LockedTask> EndReadingOf(const std::string& id);

 private:
  struct Reading {
    std::string id;
    bool is_over = false;
    // Why it could not be read.
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

  // Guarded by mutex_. Those that are not over, by ID; of these the ones that no thread has taken
  // yet; and threads that take them.
  std::map<std::string, std::shared_ptr<Reading>> readings_;
  Readings due_;
  size_t threads_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_RECORDS_RECORD_READER_H_
