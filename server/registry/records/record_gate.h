#ifndef HULLD_SERVER_REGISTRY_RECORDS_RECORD_GATE_H_
#define HULLD_SERVER_REGISTRY_RECORDS_RECORD_GATE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <string>

#include "server/registry/catalog/catalog.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/others/freshness_gate.h"
#include "server/store/store.h"

namespace hulld::server {

// Lets records count that the store found, once the catalog is of no earlier moment than they.
//
// What was found is of a moment of the store, which may be later than what is known here: then what
// came in between is taken over, or told by our own commits, first. An answer that mixed the two
// would be of no revision, and a caller that is told of the later one would be answered from the
// earlier one next.
class RecordGate {
 public:
  // Told, with the registry's mutex held, what counts from then on, or why nothing does.
  using FoundTaker = std::function<void(Locked&, const absl::StatusOr<FoundRecords>&)>;

  // All must outlive this. The mutex is the registry's.
  RecordGate(FairMutex& mutex, const Catalog& catalog, Committer& committer,
             FreshnessGate& freshness)
      : mutex_(mutex), catalog_(catalog), committer_(committer), freshness_(freshness) {}
  RecordGate(const RecordGate&) = delete;
  RecordGate& operator=(const RecordGate&) = delete;

  // Passes on what was found, now or on the committer's thread. asked_at: the catalog's revision
  // when the store was asked. UNAVAILABLE: the store went back, or cannot be asked what came in
  // between.
  void WhenReached(Locked& locked, uint64_t asked_at, absl::StatusOr<FoundRecords> found,
                   FoundTaker take);
  // The same for a thread that may wait, and does not hold the mutex. CANCELLED: should_stop said
  // so.
  absl::StatusOr<FoundRecords> AwaitReached(uint64_t asked_at, absl::StatusOr<FoundRecords> found,
                                            const std::function<bool()>& should_stop);

 private:
  bool IsBehind(const std::string& id, const absl::StatusOr<StoredHull>& stored) const;
  bool IsBehind(const FoundRecords& found) const;

  FairMutex& mutex_;
  const Catalog& catalog_;
  Committer& committer_;
  FreshnessGate& freshness_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_RECORDS_RECORD_GATE_H_
