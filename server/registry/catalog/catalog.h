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

// What is known of the hulls and bodies of a registry, at one revision: what there is under each
// ID, how many there are, and which changed lately. Every part of the registry looks here for what
// is committed, and notes here what became of it. It decides nothing and waits for nothing.
//
// Invariants:
//   - No ID is in both tables. Where the store finds records, the tables are caches: what is in
//     neither is not known (IsKnown), and an ID of which it is known that there is neither hull nor
//     body is in that of hulls.
//   - The tables hold the last committed version of everything that they know, of revision() or
//     earlier. Beside it they hold what is about to begin: a hull that is kCreating, a body without
//     a committed version.
//   - A hull whose readers are given something else from now on is in recent_changes(), whatever
//     changed it.
//
// Guarded by the registry's mutex, which is required for all but what says that it takes no lock.
class Catalog {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // limits: those in force. Store and budget must outlive this.
  Catalog(const Store& store, const Limits& limits, MemoryBudget& budget);
  Catalog(const Catalog&) = delete;
  Catalog& operator=(const Catalog&) = delete;

  // Whether the tables are caches of what the store finds.
  bool is_cache() const { return is_cache_; }
  HullTable& hulls() { return hulls_; }
  const HullTable& hulls() const { return hulls_; }
  BodyTable& bodies() { return bodies_; }
  const BodyTable& bodies() const { return bodies_; }
  RecentChanges& recent_changes() { return recent_changes_; }
  // Hits, misses, loads, growth and damage; the rest is the budget's.
  CacheStatistics& statistics() { return statistics_; }
  const CacheStatistics& statistics() const { return statistics_; }

  // The last revision that is committed and visible; 0 before Begin.
  uint64_t revision() const { return revision_; }
  // Nothing is known yet of what the store holds at this revision. First of all.
  void Begin(uint64_t revision);
  // The revision that the store gave the last change becomes visible. It is greater than the last.
  void Publish(uint64_t revision);

  // Whether it is known what there is under an ID. Cost: O(log n).
  bool IsKnown(const std::string& id) const { return hulls_.Knows(id) || bodies_.contains(id); }
  // The hull, as in HullTable; null when there is none. The ID must be known.
  HullPointer Find(const std::string& id);
  HullPointer FindVisible(const std::string& id);
  // The committed body; null when there is none. The ID must be known (unchecked: a body that could
  // not be read is not).
  std::shared_ptr<const Body> FindBody(const std::string& id);
  // Null where no change of it is submitted. Otherwise what is under the ID is not known before
  // that is committed or refused, so what depends on it waits.
  BodyTable::Entry* BodyInFlight(const std::string& id);
  // NOT_FOUND, which says so where the ID is a body's.
  absl::Status NoSuchHull(const std::string& id) const;

  // Adds what the store holds under an ID of which no hull is here: at rest, or as damaged.
  void AddStored(const std::string& id, const absl::StatusOr<StoredHull>& stored);
  // Several threads may find the same damage.
  void MarkDamaged(RegisteredHull& hull, const absl::Status& damage);
  // Readers are given something else of it from now on.
  void NoteChange(const RegisteredHull& hull);
  // Takes a hull that is gone out of sight and out of memory, and tells its sessions why.
  void Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason);
  // What the store holds, in the place of what was known.
  void AddBody(Locked& locked, const std::string& id, const absl::StatusOr<StoredBody>& stored);
  // There is no body any more. Requires that one was here.
  void EraseBody(Locked& locked, const std::string& id);

  // How many there are. Those whose creation is in flight are counted from its submission on, so
  // that --max-hulls holds. Take no lock.
  uint64_t HullCount() const {
    return is_cache_ ? kept_hulls_.load(std::memory_order_relaxed) +
                           creating_hulls_.load(std::memory_order_relaxed)
                     : hulls_.size();
  }
  uint64_t BodyCount() const {
    return kept_bodies_.load(std::memory_order_relaxed) +
           creating_bodies_.load(std::memory_order_relaxed);
  }
  // RESOURCE_EXHAUSTED: --max-hulls allows no more.
  absl::Status CheckHullCount() const;
  // Hulls and bodies of other registries count, too. Before any call.
  void CountAlso(std::function<uint64_t()> held_elsewhere) {
    held_elsewhere_ = std::move(held_elsewhere);
  }
  // Without those whose creation is in flight.
  RegistrySizes Sizes() const;

  // A creation is submitted; it is committed, or refused.
  void BeginCreatingHull() { ++creating_hulls_; }
  void EndCreatingHull(bool is_committed);
  void BeginCreatingBody() { ++creating_bodies_; }
  void EndCreatingBody(bool is_committed);
  // A deletion is committed.
  void NoteHullEnded() { --kept_hulls_; }
  void NoteBodyEnded() { --kept_bodies_; }
  // A body that is kept by the store was found there, and not created here.
  void NoteBodyFound() { ++kept_bodies_; }
  // A hull that had so many vertices has so many now.
  void NoteVertices(uint64_t before, uint64_t now) { vertex_count_ += now - before; }
  // Where this is a cache: what the store holds at revision().
  void SetTotals(const StoreTotals& totals);

 private:
  // For whom a body that was read is held.
  MemoryUse UseOfRead() const { return is_cache_ ? MemoryUse::kReading : MemoryUse::kWriting; }

  const bool is_cache_;
  const uint64_t max_hulls_;
  MemoryBudget& budget_;
  uint64_t revision_ = 0;
  HullTable hulls_;
  BodyTable bodies_;
  RecentChanges recent_changes_;
  CacheStatistics statistics_;
  // May be empty.
  std::function<uint64_t()> held_elsewhere_;
  uint64_t vertex_count_ = 0;
  // How many the store holds at revision_ (hulls: where hulls_ is a cache), and those whose
  // creation is not committed yet. Changed under the mutex.
  std::atomic<uint64_t> kept_hulls_ = 0;
  std::atomic<uint64_t> creating_hulls_ = 0;
  std::atomic<uint64_t> kept_bodies_ = 0;
  std::atomic<uint64_t> creating_bodies_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_CATALOG_H_
