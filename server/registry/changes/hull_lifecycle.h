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

// Creation, deletion, and replacement of hulls.
//
// Each depends on the state of an ID: it loads that state, waits until no change of the ID is in
// flight, and then decides within one hold of the mutex. The decision is a single change, invisible
// until the store commits it; a refusal leaves the former state. If a peer server committed first,
// the change is retried on the new state.
//
// Guarded by the registry's mutex; functions without a Locked parameter acquire it.
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

  // See Registry.
  void Create(const std::string& id, bool if_absent, Reply<CreateResult> done);
  void Delete(const std::string& id, std::optional<uint64_t> if_revision, Reply<uint64_t> done);
  void Replace(Replacement replacement, Reply<ReplaceResult> done);

  // Creates a hull. done: called with the mutex held when the hull becomes visible, or with an
  // error; ABORTED (Committer::IsSuperseded): a peer server changed the ID first. Requires: the ID
  // is known to have no hull (checked), and no change of a body with the ID is in flight (not
  // checked: its completion would find the hull).
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
