#ifndef HULLD_SERVER_REGISTRY_CATALOG_HULL_TABLE_H_
#define HULLD_SERVER_REGISTRY_CATALOG_HULL_TABLE_H_

#include <absl/container/flat_hash_set.h>
#include <absl/hash/hash.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/registry/catalog/hull_state.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/records.h"

namespace hulld::server {

// All in-memory data of a small hull at rest, except for its record. The structures for queries and
// growth are rebuilt at the next use, within a few microseconds.
struct CompactHull {
  // Includes all vertices, and no point outside the hull.
  std::vector<Vector> points;
  // Last sequence of each writer; empty if the store has them.
  std::vector<std::pair<std::string, uint64_t>> writers;

  size_t MemoryBytes() const {
    size_t bytes = sizeof(*this) + points.capacity() * sizeof(Vector) +
                   writers.capacity() * sizeof(writers.front());
    for (const auto& [id, sequence] : writers) bytes += id.capacity();
    return bytes;
  }
};

// Hulls of a registry by ID.
//
// A store may contain millions of hulls, of which few are in use. A hull at rest, unused since it
// was loaded or for some time, needs only a record: 240 bytes of heap including its ID instead of
// 1120; with a 32-byte ID, 289 instead of 1271 (**observed**: mallinfo2 of glibc 2.36 over 200 000
// hulls; IDs of up to 15 bytes need no extra memory), and about 20 bytes in the index. A lookup
// turns the record into a RegisteredHull. A clock hand turns it back into a record when it finds
// the hull unused. Each operation advances the hand by a few hulls, so no pass over all of them is
// needed.
//
// A small hull that is in memory and has not been looked up for some time (RestIdle) keeps only its
// record and its points (CompactHull). If the store can read it back, the points are evicted before
// any hull in use.
//
// If the store supports record lookup, this is a cache of records, and of IDs known to have neither
// a hull nor a body: an ID without an entry is unknown. When the cache exceeds its capacity, the
// hand evicts entries that are at rest and were not looked up since its last visit.
//
// Guarded by the registry's mutex.
class HullTable {
 public:
  // Approximate bytes of a record with its ID.
  static constexpr uint64_t kBytesOfRecord = 320;

  // readable: true if the store can read hulls back. The budget must outlive this.
  HullTable(bool readable, MemoryBudget& budget);

  // Makes this a cache of at most `records`. Only hulls in use may exceed the capacity. Requires an
  // empty table.
  void SetCapacity(size_t records) { capacity_ = records; }

 private:
  // State of a hull at rest, except its ID.
  struct RestingHull {
    RestingHull() = default;
    explicit RestingHull(const StoredHull& stored);
    HullRecord RecordWith(const std::string& id) const;

    uint64_t create_revision = 0;
    uint64_t revision = 0;
    uint64_t vertex_count = 0;
    PointCounts counts;
    uint64_t writer_count = 0;
    VertexLayout layout;
    // Empty if unknown.
    Box box = Box::Empty();
    int8_t dimension = -1;
    // Null if the store has the points, or there are none.
    std::unique_ptr<CompactHull> compact;
  };

 public:
  class Entry {
   public:
    bool visible() const;
    // Revision of the committed hull.
    uint64_t revision() const;
    // Null for a hull at rest.
    const HullPointer& awake() const { return awake_; }
    // Points of a hull at rest, if they are in memory. They are kept while the hull is awake, and
    // are valid until it changes.
    const CompactHull* compact() const { return resting_.compact.get(); }
    // Describes the committed hull for watches and lists. id: the ID of the hull.
    HullChange Describe(const std::string& id) const;

   private:
    friend class HullTable;

    // Null: the hull is at rest, or absent.
    HullPointer awake_;
    RestingHull resting_;
    bool is_absent_ = false;
    // True if it was looked up since the last visit of the hand.
    bool is_used_ = false;
    // True if it was not looked up since the last call of RestIdle.
    bool is_idle_ = false;
  };
  using Entries = std::map<std::string, Entry>;

  // Number of entries: unless this is a cache, of hulls.
  size_t size() const { return entries_.size(); }
  bool contains(const std::string& id) const;
  // Returns true if the ID's state is known, including absence. Unless this is a cache, an ID
  // without an entry is absent.
  bool Knows(const std::string& id) const { return !is_cache() || index_.contains(id); }
  // Entries in the byte order of the IDs. A cache includes known absences.
  const Entries& entries() const { return entries_; }

  // Returns the hull and wakes it if it is at rest; null if it is absent; nullopt if it is unknown.
  // Cost: O(1), plus restoring the points of a small hull.
  std::optional<HullPointer> LookUp(const std::string& id);
  // Prefetches the index entry of an ID that LookUp or Find will look up.
  void Prefetch(const std::string& id) const { index_.prefetch(id); }
  // Like LookUp, but returns null for an unknown ID.
  HullPointer Find(const std::string& id) { return LookUp(id).value_or(nullptr); }
  // Adds a stored hull, at rest. Requires: no hull has its ID.
  void AddResting(const StoredHull& stored);
  // Records that the ID is absent. Requires: the ID is unknown.
  void NoteAbsent(const std::string& id);
  // Removes a known absence, because a body now has the ID (BodyTable).
  void ForgetAbsent(const std::string& id);
  // Adds a hull in use. Requires: no hull has its ID.
  HullPointer Insert(const StoredHull& stored, const HullState& state);
  void Insert(const HullPointer& hull);
  // Removes the hull; its absence is known from then on. Requires an entry.
  void Erase(const HullPointer& hull);

  // Advances the hand by kHullsPerStep and puts unused hulls to rest; a cache also evicts down to
  // its limit. Cost: O(log n).
  void RestSome(Locked& locked);
  static constexpr int kHullsPerStep = 4;
  // Visits the hulls after `cursor`, initially empty, as many as fit into one critical section.
  // Puts small hulls to rest that are in memory, unused, and have not been looked up since the last
  // visit. Returns false if no hull is left to visit; returns false immediately if the last two
  // passes found no hull in use and none has been looked up since. Cost: about 50 us.
  bool RestIdle(Locked& locked, std::string& cursor);
  // Call after a change of the hull if no session is expected to change it further. Puts a small
  // hull to rest after kMaxJustChanged later calls for small hulls, unless it is looked up before
  // then. So a server that is being filled with small hulls keeps only a few of them in full form.
  // Cost: about 1 us.
  void RestSoon(Locked& locked, const RegisteredHull& hull);
  static constexpr size_t kMaxJustChanged = 1024;
  // Bytes of the points and writers of hulls at rest, which count against the budget.
  uint64_t compact_bytes() const { return compact_bytes_; }

 private:
  using Place = Entries::iterator;
  // Hashes and compares entries by their IDs.
  struct HashOfId {
    using is_transparent = void;
    size_t operator()(std::string_view id) const { return absl::HashOf(id); }
    size_t operator()(Place place) const { return (*this)(place->first); }
  };
  struct EqualIds {
    using is_transparent = void;
    static std::string_view IdOf(std::string_view id) { return id; }
    static std::string_view IdOf(Place place) { return place->first; }
    template <typename A, typename B>
    bool operator()(const A& a, const B& b) const {
      return IdOf(a) == IdOf(b);
    }
  };

  bool is_cache() const { return capacity_.has_value(); }
  std::pair<Place, bool> AddEntry(const std::string& id);
  void EraseEntry(Place place);
  Entry& Add(const std::string& id);
  void Wake(const std::string& id, Entry& entry);
  bool RestCompact(Locked& locked, Entry& entry);
  std::unique_ptr<CompactHull> ExchangeCompact(Entry& entry, std::unique_ptr<CompactHull> compact);
  void DropCompact();

  const bool readable_;
  MemoryBudget& budget_;
  Entries entries_;
  // All entries, for lookups. A search of the ordered map takes about 2 us with a million entries.
  absl::flat_hash_set<Place, HashOfId, EqualIds> index_;
  // In records; set if this is a cache.
  std::optional<size_t> capacity_;
  // ID of the last hull that RestSome visited, and of the last one that DropCompact visited.
  std::string hand_;
  std::string compact_hand_;
  // IDs of the hulls passed to RestSoon and not visited by it yet, oldest first.
  std::deque<std::string> just_changed_;
  // Sum over all entries, and the account that counts it.
  uint64_t compact_bytes_ = 0;
  // Passes of RestIdle started since a small hull was last found in use.
  uint64_t passes_since_use_ = 0;
  MemoryBudget::Account compact_account_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_HULL_TABLE_H_
