#ifndef HULLD_SERVER_REGISTRY_CATALOG_BODY_H_
#define HULLD_SERVER_REGISTRY_CATALOG_BODY_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/query/body/query_body.h"
#include "server/process/synchronization.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/records.h"

namespace hulld::server {

// A body at one revision. Immutable except for the boxes of its pieces, which are built by the
// first query and rebuilt after a hull of a piece changed. Thread-safe.
class Body {
 public:
  // use: the memory use to which the body is charged.
  Body(StoredBody stored, MemoryBudget& budget, MemoryUse use)
      : stored_(std::make_shared<StoredBody>(std::move(stored))),
        charge_(budget, use, stored_->MemoryBytes()),
        box_charge_(budget, MemoryUse::kReading) {}
  // A body as read from the store; damaged if `stored` is not OK.
  Body(const std::string& id, const absl::StatusOr<StoredBody>& stored, MemoryBudget& budget,
       MemoryUse use)
      : Body(stored.ok() ? *stored : StoredBody{{id, 0, 0}, {}, {}}, budget, use) {
    damage_ = stored.status();
  }

  const BodyRecord& record() const { return stored_->record; }
  const std::vector<std::string>& hull_ids() const { return stored_->hull_ids; }
  const std::vector<StoredPiece>& pieces() const { return stored_->pieces; }
  // OK unless the store cannot read the body back.
  const absl::Status& damage() const { return damage_; }
  // Describes the body for watches.
  HullChange Describe() const { return Describe(*stored_, damage_); }
  static HullChange Describe(const StoredBody& stored, const absl::Status& damage);

  // Returns boxes of the pieces. Requires: `pieces` belong to this body, and their hulls are at
  // `hull_revisions`.
  std::shared_ptr<const PieceBoxes> BoxesOf(std::span<const BodyPiece> pieces,
                                            std::vector<uint64_t> hull_revisions) const;

  // For the store, which assigns revisions at commit, before the body is visible.
  const std::shared_ptr<StoredBody>& stored() const { return stored_; }

 private:
  const std::shared_ptr<StoredBody> stored_;
  absl::Status damage_;

  const MemoryCharge charge_;

  mutable Mutex mutex_;
  // mutex_ guards the members below.
  mutable MemoryCharge box_charge_;
  mutable std::vector<uint64_t> box_revisions_;
  mutable std::shared_ptr<const PieceBoxes> boxes_;
};

// Bodies of a registry by ID, including their pieces.
//
// If the store supports record lookup, this is a cache: an ID without an entry is unknown, unless
// the hull table knows its hull or its absence. The capacity is in bytes, because bodies range from
// a few hundred bytes to --max-pieces-per-body pieces. Eviction removes unreferenced bodies, least
// recently used first.
//
// Guarded by the registry's mutex.
class BodyTable {
 public:
  // State of an ID that belongs, or is about to belong, to a body.
  struct Entry {
    // Null until the first commit.
    const std::shared_ptr<const Body>& committed() const { return body_; }
    // True if the store can restore everything that the entry contains.
    bool IsUnused() const { return !in_flight && waiting.empty() && body_.use_count() == 1; }

    // True if a change is submitted, but neither committed nor refused; `waiting` runs after it.
    bool in_flight = false;
    std::deque<std::function<void(Locked&)>> waiting;

   private:
    friend class BodyTable;

    std::shared_ptr<const Body> body_;
    // Position in used_.
    std::list<const std::string*>::iterator place_;
  };
  using Entries = std::map<std::string, Entry>;

  // Approximate bytes of an entry, excluding the pieces and names of its body.
  static constexpr uint64_t kBytesOfEntry = 512;

  // Makes this a cache of at most `bytes`. Only entries in use may exceed the capacity. Requires an
  // empty table.
  void SetCapacity(uint64_t bytes) { capacity_ = bytes; }

  size_t size() const { return entries_.size(); }
  bool contains(const std::string& id) const { return entries_.contains(id); }
  // Entries in the byte order of the IDs.
  const Entries& entries() const { return entries_; }
  // Returns null if there is no body or the ID is unknown. Cost: O(log n).
  Entry* Find(const std::string& id);
  // Like Find, but adds an entry without a body if there is none.
  Entry& Add(const std::string& id);
  // Sets the committed body; null for none. Requires an entry.
  void Set(Locked& locked, const std::string& id, std::shared_ptr<const Body> body);
  // Requires an entry.
  void Erase(Locked& locked, const std::string& id);

  // Evicts down to the limit of a cache. Cost: O(log n) per evicted body.
  void DropSome(Locked& locked);
  // Maximum number of bodies in use that one call skips; takes about 1 us.
  static constexpr int kMaxSkipped = 16;

 private:
  static uint64_t BytesOf(const Entry& entry);

  Entries entries_;
  // Most recently used first.
  std::list<const std::string*> used_;
  uint64_t bytes_ = 0;
  // In bytes; set if this is a cache.
  std::optional<uint64_t> capacity_;
};

// A body as seen by one call. References the hulls of its pieces. Charged to --memory-limit.
struct ServedBody {
  std::shared_ptr<const Body> body;
  // In the order of Body::hull_ids().
  std::vector<HullView> hulls;
  QueryBody query;
  MemoryCharge charge;

  const HullView& hull_of(uint32_t piece) const { return hulls[body->pieces()[piece].hull]; }
};

// Errors about a hull or a body. kind: "hull" or "body".
//
// Returns the text that names it, as in: hull "a/b".
std::string Quoted(const std::string& kind, const std::string& id);
// NOT_FOUND. is_other_kind: the ID belongs to an object of the other kind, which the message says.
absl::Status NotFound(const std::string& kind, const std::string& id, bool is_other_kind = false);
// ALREADY_EXISTS: the ID requested for a hull belongs to a body, or the reverse. kind: that of the
// existing object.
absl::Status IdTaken(const std::string& kind, const std::string& id);
// Returns OK if it is at the required revision, if any. ABORTED: it is not. revision: the current
// one; 0: it does not exist, or its record is damaged.
absl::Status CheckRevision(const std::string& kind, const std::string& id, uint64_t revision,
                           std::optional<uint64_t> if_revision);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_BODY_H_
