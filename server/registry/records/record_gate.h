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

// Releases records found in the store after the catalog has reached their revision.
//
// Found records are of a store revision that may be later than the catalog's. The changes in
// between are then applied first, from peer servers or from local commits. An answer mixing both
// revisions would be inconsistent, and a caller that saw the later one could be answered from the
// earlier one next.
class RecordGate {
 public:
  // Called with the registry's mutex held, with the records valid from then on, or an error.
  using FoundTaker = std::function<void(Locked&, const absl::StatusOr<FoundRecords>&)>;

  // All must outlive this. The mutex is the registry's.
  RecordGate(FairMutex& mutex, const Catalog& catalog, Committer& committer,
             FreshnessGate& freshness)
      : mutex_(mutex), catalog_(catalog), committer_(committer), freshness_(freshness) {}
  RecordGate(const RecordGate&) = delete;
  RecordGate& operator=(const RecordGate&) = delete;

  // Passes `found` to `take`, now or on the committer's thread. asked_at: the catalog's revision at
  // the time of the store query. UNAVAILABLE: the store went back, or cannot report the changes in
  // between.
  void WhenReached(Locked& locked, uint64_t asked_at, absl::StatusOr<FoundRecords> found,
                   FoundTaker take);
  // As WhenReached, but blocks. Requires that the thread does not hold the mutex. CANCELLED:
  // should_stop returned true.
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
