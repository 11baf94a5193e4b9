#ifndef HULLD_SERVER_REGISTRY_BODIES_BODY_REGISTRY_H_
#define HULLD_SERVER_REGISTRY_BODIES_BODY_REGISTRY_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "server/registry/catalog/body.h"
#include "server/registry/catalog/catalog.h"
#include "server/registry/catalog/change_feed.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/commit/committer.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/others/after_others.h"
#include "server/registry/others/freshness_gate.h"
#include "server/registry/records/record_lister.h"
#include "server/registry/records/record_reader.h"
#include "server/store/store.h"

namespace hulld::server {

// Creation, change, deletion, and lookup of bodies. A body is small compared to the hulls of its
// pieces, so a known body is complete in memory, counted like memory that calls hold for long.
//
// Invariants:
//   - At most one change of a body is in flight (BodyTable::Entry::in_flight). Tasks that depend on
//     the ID wait in the entry and resume in order after it, or, if a peer server committed first,
//     after its change is applied (AfterOthers).
//   - A body becomes visible to all readers atomically after its commit. A refusal leaves the
//   former
//     state.
//   - A hull and a body never share an ID: a put is refused if a hull has it, and waits if the
//     creation or end of a hull is in flight.
//
// Guarded by the registry's mutex; functions without a Locked parameter acquire it.
class BodyRegistry {
 public:
  // All must outlive this. The mutex is the registry's.
  BodyRegistry(Store& store, FairMutex& mutex, Catalog& catalog, MemoryBudget& memory,
               Committer& committer, ChangeFeed& feed, AfterOthers& after_others,
               FreshnessGate& freshness, RecordReader& records, RecordLister& lister)
      : store_(store),
        mutex_(mutex),
        catalog_(catalog),
        memory_(memory),
        committer_(committer),
        feed_(feed),
        after_others_(after_others),
        freshness_(freshness),
        records_(records),
        lister_(lister) {}
  BodyRegistry(const BodyRegistry&) = delete;
  BodyRegistry& operator=(const BodyRegistry&) = delete;

  // Loads all bodies of a store that does not find records. Call after loading the hulls.
  absl::Status Load(Locked& locked);

  // As PutBody, DeleteBody, FindBodies, TryFindBodies and ListBodies in Registry.
  void Put(StoredBody body, std::optional<uint64_t> if_revision, Reply<PutBodyResult> done);
  void Delete(const std::string& id, std::optional<uint64_t> if_revision, Reply<uint64_t> done);
  FoundBodies Find(std::span<const std::string> ids, const std::function<bool()>& should_stop);
  std::optional<FoundBodies> TryFind(std::span<const std::string> ids);
  absl::StatusOr<BodyPage> List(const std::string& prefix, const std::string& after,
                                size_t page_size, const std::function<bool()>& should_stop);

 private:
  void PutLocked(Locked& locked, const std::shared_ptr<Body>& body,
                 std::optional<uint64_t> if_revision, const Reply<PutBodyResult>& done);
  absl::Status CheckPut(const std::string& id, std::optional<uint64_t> if_revision);
  void DeleteLocked(Locked& locked, const std::string& id, std::optional<uint64_t> if_revision,
                    const Reply<uint64_t>& done);
  void Submit(Locked& locked, Change change, Committer::Completion finish);
  void Complete(Locked& locked, const std::string& id, const Committer::Completion& finish,
                const absl::Status& status, Change& change);
  std::optional<FoundBodies> Find(Locked& locked, std::span<const std::string> ids,
                                  const std::function<bool()>& should_stop, bool may_wait);

  Store& store_;
  FairMutex& mutex_;
  Catalog& catalog_;
  MemoryBudget& memory_;
  Committer& committer_;
  ChangeFeed& feed_;
  AfterOthers& after_others_;
  FreshnessGate& freshness_;
  RecordReader& records_;
  RecordLister& lister_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_BODIES_BODY_REGISTRY_H_
