#ifndef HULLD_SERVER_REGISTRY_CATALOG_CATALOG_H_
#define HULLD_SERVER_REGISTRY_CATALOG_CATALOG_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "server/registry/catalog/body.h"
#include "server/registry/catalog/body_table.h"
#include "server/registry/catalog/hull_table.h"
#include "server/registry/catalog/known_hulls.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/settings/config.h"
#include "server/store/store.h"

namespace hulld::server {

// In-memory state of a registry's hulls and bodies at one revision: the entry of each ID, the
// counts, and the recent changes. All parts of the registry read committed state here and record
// the outcome of changes here. The catalog makes no decisions and never blocks.
//
// Invariants:
// - No ID is in both tables. If the store finds records, the tables are caches: an ID in neither is
//   unknown (IsKnown). The known absence of both a hull and a body is an entry of the hull table.
// - The tables contain the last committed version of each known entry, of revision() or earlier.
//   They also contain entries being created: a hull in kCreating, a body without a committed
//   version.
// - Every reader-visible change of a hull is in recent_changes(), regardless of its cause.
//
// Guarded by the registry's mutex, which every function requires unless its comment says that it
// takes no lock.
class Catalog {
 public:
  // limits: the limits in force. Store and budget must outlive this.
  Catalog(const Store& store, const Limits& limits, MemoryBudget& budget);
  Catalog(const Catalog&) = delete;
  Catalog& operator=(const Catalog&) = delete;

  // True if the tables cache records that the store can find.
  bool is_cache() const { return is_cache_; }
  HullTable& hulls() { return hulls_; }
  BodyTable& bodies() { return bodies_; }
  RecentChanges& recent_changes() { return recent_changes_; }
  // Hits, misses, loads, growth and damage; the budget counts the rest.
  CacheStatistics& statistics() { return statistics_; }
  const CacheStatistics& statistics() const { return statistics_; }

  // Last committed and visible revision; 0 before Begin.
  uint64_t revision() const { return revision_; }
  // Starts at this revision of the store with empty tables. Must be called first.
  void Begin(uint64_t revision);
  // Makes the revision of the last change visible. Requires: it is greater than revision().
  void Publish(uint64_t revision);

  // Returns true if the ID's state is known, including absence. Cost: O(log n).
  bool IsKnown(const std::string& id) const { return hulls_.Knows(id) || bodies_.contains(id); }
  // Returns the hull as HullTable does; null if there is none. Requires IsKnown(id).
  HullPointer Find(const std::string& id);
  HullPointer FindVisible(const std::string& id);
  // Returns the committed body; null if there is none. Requires IsKnown(id) (not checked: a body
  // whose read failed is unknown).
  std::shared_ptr<const Body> FindBody(const std::string& id);
  // Returns the entry of a body with a change in flight, or null. A caller that depends on the ID
  // must wait until that change is committed or refused.
  BodyTable::Entry* BodyInFlight(const std::string& id);
  // NOT_FOUND; if the ID belongs to a body, the message says so.
  absl::Status NoSuchHull(const std::string& id) const;

  // Adds a stored hull, at rest or as damaged. Requires: the catalog has no hull with the ID.
  void AddStored(const std::string& id, const absl::StatusOr<StoredHull>& stored);
  // Marks a hull as damaged. Idempotent, because several threads may find the same damage.
  void MarkDamaged(RegisteredHull& hull, const absl::Status& damage);
  // Records a reader-visible change of the hull.
  void NoteChange(const RegisteredHull& hull);
  // Removes a hull that is gone, discards its memory, and ends its sessions with `reason`.
  void Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason);
  // Replaces the known state of the body with the stored one.
  void AddBody(Locked& locked, const std::string& id, const absl::StatusOr<StoredBody>& stored);
  // Logs that the store contains a body with the ID of a hull, which the server never writes. The
  // hull takes precedence, because its vertices could not be restored.
  static void LogBodyUnderHull(const std::string& id);
  // Removes a body. Requires: the catalog has it.
  void EraseBody(Locked& locked, const std::string& id);

  // Counts of hulls and bodies. Creations count from submission on, to enforce --max-hulls. These
  // functions take no lock.
  uint64_t HullCount() const {
    return is_cache_ ? kept_hulls_.load(std::memory_order_relaxed) +
                           creating_hulls_.load(std::memory_order_relaxed)
                     : hulls_.size();
  }
  uint64_t BodyCount() const {
    return kept_bodies_.load(std::memory_order_relaxed) +
           creating_bodies_.load(std::memory_order_relaxed);
  }
  // RESOURCE_EXHAUSTED: --max-hulls is reached.
  absl::Status CheckHullCount() const;
  // Returns the counts, excluding creations in flight.
  RegistrySizes Sizes() const;

  // Count a creation at its submission, and at its commit or refusal. A refused hull is forgotten.
  void BeginCreatingHull() { ++creating_hulls_; }
  void EndCreatingHull(Locked& locked, const HullPointer& hull, const absl::Status& status);
  void BeginCreatingBody() { ++creating_bodies_; }
  void EndCreatingBody(bool is_committed);
  // Count a committed deletion.
  void NoteHullEnded() { --kept_hulls_; }
  void NoteBodyEnded() { --kept_bodies_; }
  // Counts a body found in the store rather than created here.
  void NoteBodyFound() { ++kept_bodies_; }
  // Updates the vertex total after a hull's count changed.
  void NoteVertices(uint64_t before, uint64_t now) { vertex_count_ += now - before; }
  // Sets the totals of the store at revision(). Requires is_cache().
  void SetTotals(const StoreTotals& totals);

 private:
  // Memory use to which a body read from the store is charged.
  MemoryUse UseOfRead() const { return is_cache_ ? MemoryUse::kReading : MemoryUse::kWriting; }

  const bool is_cache_;
  const uint64_t max_hulls_;
  MemoryBudget& budget_;
  uint64_t revision_ = 0;
  HullTable hulls_;
  BodyTable bodies_;
  RecentChanges recent_changes_;
  CacheStatistics statistics_;
  uint64_t vertex_count_ = 0;
  // Numbers of hulls and bodies in the store at revision_ (hulls: only if hulls_ is a cache), and
  // of uncommitted creations. Changed under the mutex.
  std::atomic<uint64_t> kept_hulls_ = 0;
  std::atomic<uint64_t> creating_hulls_ = 0;
  std::atomic<uint64_t> kept_bodies_ = 0;
  std::atomic<uint64_t> creating_bodies_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_CATALOG_H_
