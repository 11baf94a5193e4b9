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

// Returns hulls ready to be served, all at one revision.
//
// A read looks up kMostLookupsPerHold hulls per hold of the mutex and releases it in between. At
// the end it looks up the hulls that changed since, until one hold covers all that are left: then
// all are at one revision. This terminates, because a commit takes longer than a lookup. Readers
// and writers never wait for each other: a reader takes the version of the committed state, made in
// O(1), and never touches a builder.
//
// A read waits only for the store: for the record of an unknown hull (RecordReader), and for points
// that are not in memory. One reader loads a hull for all that request it
// (RegisteredHull::loading). A read of many hulls has threads load the next ones while the first
// are looked up. It finishes all such loads of its own before it waits for another read, which may
// wait for them.
//
// Guarded by the registry's mutex, which this class acquires, and releases to wait and to prepare.
class HullReader {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // All must outlive this. limits: the limits in force. loaders: threads that help readers of many
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

  // See Registry.
  absl::StatusOr<Resolved> Refresh(std::span<const std::string> ids, KnownHulls& known,
                                   const std::function<bool()>& should_stop, const ReadPlan& plan);
  std::optional<Resolved> TryResolve(std::span<const std::string> ids, const ReadPlan& plan);
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop);
  // Sets the histogram of snapshot build times. Call before the first; it must outlive this.
  void SetMetrics(prometheus::Histogram& snapshot_seconds) {
    snapshot_seconds_ = &snapshot_seconds;
  }

 private:
  struct HullsRead;
  // Outcome of a lookup without an error.
  enum class LookUpEnd {
    kDone,
    // The lookup would have to wait, but may not.
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
  // May be null.
  prometheus::Histogram* snapshot_seconds_ = nullptr;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
