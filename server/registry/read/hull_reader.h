#ifndef HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
#define HULLD_SERVER_REGISTRY_READ_HULL_READER_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "server/process/metrics.h"
#include "server/process/worker_pool.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/known_hulls.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/freshness_gate.h"
#include "server/registry/read/preparer.h"
#include "server/registry/records/record_reader.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// Gives readers hulls that are ready to be served, all current at one revision.
//
// A read looks up its hulls kMostLookupsPerHold at a time and lets others pass in between. At the
// end it looks again for those that changed meanwhile, until the mutex was held since the first of
// what is left: then all are of one moment. That comes to an end, since a commit takes longer than
// a lookup. Readers and writers never wait for each other: a reader takes the version of what is
// committed, which is made in O(1), and never touches a builder.
//
// A read waits for the store at most: for the record of a hull that is not known (RecordReader),
// and for points that are not in memory. Those one reader reads for all that ask
// (RegisteredHull::loading); a read of many hulls has threads read the next ones while the first
// are looked up. Before a read waits for anything that another one does, it ends all such loading
// of its own, since others may wait for that.
//
// Guarded by the registry's mutex, which it takes, and releases while it waits and prepares.
class HullReader {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // All must outlive this. limits: those in force. loaders: threads that help readers of many
  // hulls.
  HullReader(Store& store, const Limits& limits, FairMutex& mutex, Catalog& catalog,
             MemoryBudget& memory, FreshnessGate& freshness, RecordReader& records,
             Preparer& preparer, WorkerPool& loaders)
      : store_(store),
        limits_(limits),
        mutex_(mutex),
        catalog_(catalog),
        memory_(memory),
        freshness_(freshness),
        records_(records),
        preparer_(preparer),
        loaders_(loaders) {}
  HullReader(const HullReader&) = delete;
  HullReader& operator=(const HullReader&) = delete;

  // As in Registry.
  absl::StatusOr<Resolved> Refresh(std::span<const std::string> ids, KnownHulls& known,
                                   const std::function<bool()>& should_stop, const ReadPlan& plan);
  std::optional<Resolved> TryResolve(std::span<const std::string> ids, const ReadPlan& plan);
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop);
  // Where the making of canonical snapshots is timed; set before the first, and outlives this.
  void SetMetrics(prometheus::Histogram& snapshot_seconds) {
    snapshot_seconds_ = &snapshot_seconds;
  }

 private:
  struct HullsRead;
  // How a lookup ended that was not refused.
  enum class LookUpEnd {
    kDone,
    // It would have to wait, and may not.
    kWouldWait,
  };

  absl::StatusOr<LookUpEnd> LookUpDue(Locked& locked, const HullsRead& read);
  absl::StatusOr<LookUpEnd> LookUpAll(Locked& locked, const HullsRead& read);
  absl::StatusOr<LookUpEnd> LookUp(Locked& locked, const HullsRead& read, uint32_t k);
  absl::StatusOr<bool> AwaitRecord(Locked& locked, const HullsRead& read, uint32_t k);
  absl::StatusOr<bool> AwaitPoints(Locked& locked, const HullsRead& read, uint32_t k,
                                   RegisteredHull& hull, bool& was_missing);
  absl::Status PrepareFirst(Locked& locked, const HullsRead& read, RegisteredHull& hull);
  static bool IsHeld(const KnownHulls::Known& known, const RegisteredHull& hull);
  void NoteView(Locked& locked, const HullPointer& hull, KnownHulls& hulls, uint32_t k,
                bool was_missing);
  absl::Status CheckReaders(Locked& locked, const KnownHulls& known);

  void LoadMany(Locked& locked, const HullsRead& read, uint32_t k);
  bool BeginLoading(Locked& locked, const HullsRead& read);
  void EndLoading(Locked& locked, const HullsRead& read);
  void EndAllLoading(Locked& locked, const HullsRead& read);
  absl::Status LoadOne(Locked& locked, RegisteredHull& hull,
                       const std::function<bool()>& should_stop);

  Store& store_;
  const Limits& limits_;
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  FreshnessGate& freshness_;
  RecordReader& records_;
  Preparer& preparer_;
  WorkerPool& loaders_;
  // Null: nowhere.
  prometheus::Histogram* snapshot_seconds_ = nullptr;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
