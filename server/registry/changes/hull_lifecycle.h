#ifndef HULLD_SERVER_REGISTRY_CHANGES_HULL_LIFECYCLE_H_
#define HULLD_SERVER_REGISTRY_CHANGES_HULL_LIFECYCLE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/changes/hull_changes.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/freshness_gate.h"
#include "server/registry/records/record_reader.h"
#include "server/store/store.h"

namespace hulld::server {

struct RegisteredHull;

// How hulls begin and end: creation, deletion, and replacement, which is both at once.
//
// Each of them depends on what there is under an ID, so it first makes that known, waits until no
// change under the ID is in flight, and decides then, in one hold of the mutex. What it decided is
// one change. Nothing of it is seen before the store has kept it; a refusal leaves what there was.
// A change that another server preceded is made anew of what there is by then.
//
// Guarded by the registry's mutex, which the functions that take no Locked take.
class HullLifecycle {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;
  using Creation = std::function<void(Locked&, absl::StatusOr<HullPointer>)>;

  // All must outlive this.
  HullLifecycle(const Store& store, Catalog& catalog, MemoryBudget& memory, ChangeFeed& feed,
                FreshnessGate& freshness, RecordReader& records, HullChanges& changes)
      : store_(store),
        catalog_(catalog),
        memory_(memory),
        feed_(feed),
        freshness_(freshness),
        records_(records),
        changes_(changes) {}
  HullLifecycle(const HullLifecycle&) = delete;
  HullLifecycle& operator=(const HullLifecycle&) = delete;

  // As in Registry.
  void Create(const std::string& id, bool if_absent, Reply<CreateResult> done);
  void Delete(const std::string& id, std::optional<uint64_t> if_revision, Reply<uint64_t> done);
  void Replace(Replacement replacement, Reply<ReplaceResult> done);

  // Creates a hull. done: told of it with the mutex held, at the moment when it becomes visible, or
  // why it does not; ABORTED (Committer::IsSuperseded): another server changed the ID first.
  // Requires that it is known that there is no hull, which is checked, and that no change of a body
  // with the ID is in flight (unchecked: its completion would find the hull).
  void CreateNew(Locked& locked, const std::string& id, const Creation& done);

 private:
  void CreateLocked(Locked& locked, const std::string& id, bool if_absent,
                    const Reply<CreateResult>& done);
  void DeleteLocked(Locked& locked, const std::string& id, std::optional<uint64_t> if_revision,
                    const Reply<uint64_t>& done);
  void ReplaceLocked(Locked& locked, const std::shared_ptr<Replacement>& replacement,
                     const Reply<ReplaceResult>& done);
  absl::Status CheckReplacement(const RegisteredHull* former, const Replacement& replacement) const;
  static Change MakeChange(const RegisteredHull* former, Replacement& replacement);
  void CommitReplacement(Locked& locked, const HullPointer& former,
                         const std::shared_ptr<Replacement>& replacement,
                         const Reply<ReplaceResult>& done);
  absl::StatusOr<ReplaceResult> FinishReplacement(Locked& locked, const HullPointer& former,
                                                  const HullPointer& hull,
                                                  const absl::Status& status, const Change& change);
  static void TakeBack(RegisteredHull& hull, Change& change, Replacement& replacement);

  const Store& store_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  ChangeFeed& feed_;
  FreshnessGate& freshness_;
  RecordReader& records_;
  HullChanges& changes_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CHANGES_HULL_LIFECYCLE_H_
