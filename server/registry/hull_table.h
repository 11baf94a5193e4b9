#ifndef HULLD_SERVER_REGISTRY_HULL_TABLE_H_
#define HULLD_SERVER_REGISTRY_HULL_TABLE_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "server/registry/hull_state.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/registry_types.h"
#include "server/store/hull_record.h"

namespace hulld::server {

// The hulls of a registry, by ID.
//
// A store may hold millions of hulls, of which few are in use. A hull that nobody used since it was
// read from the store, or that came to rest, takes a record here and no more: 240 bytes of heap,
// its ID included, instead of 1120; with an ID of 32 bytes 289 instead of 1271 (observed: mallinfo2
// of glibc 2.36 over 200 000 hulls; IDs of up to 15 bytes cost nothing more). It becomes a
// RegisteredHull when it is looked for, and a record again when a hand that goes round the table
// finds that nothing of it is in use. Each operation moves the hand by a few hulls, so there is no
// pass over all of them.
//
// Guarded by the registry's mutex.
class HullTable {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // readable: whether the store gives back what it keeps of hulls. The budget must outlive this.
  HullTable(bool readable, MemoryBudget& budget) : readable_(readable), budget_(budget) {}

 private:
  // What is known of a hull at rest, beside its ID.
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
    Vector low = Vector::Zero();
    Vector high = Vector::Zero();
    int8_t dimension = -1;
    bool has_box = false;
  };

 public:
  class Entry {
   public:
    bool visible() const;
    // The revision of the committed hull.
    uint64_t revision() const;
    // Null for a hull at rest.
    const HullPointer& awake() const { return awake_; }
    // The committed hull, as watches and lists are told of it. id: its own.
    HullChange Describe(const std::string& id) const;

   private:
    friend class HullTable;

    // Null: at rest.
    HullPointer awake_;
    RestingHull resting_;
  };
  using Entries = std::map<std::string, Entry>;

  bool empty() const { return entries_.empty(); }
  size_t size() const { return entries_.size(); }
  // The same for who does not have the mutex.
  size_t held() const { return held_.load(std::memory_order_relaxed); }
  bool contains(const std::string& id) const { return entries_.contains(id); }
  bool IsVisible(const std::string& id) const;
  // For walks in the byte order of the IDs.
  const Entries& entries() const { return entries_; }

  // The hull, no longer at rest; null when there is none. Cost: O(log n).
  HullPointer Find(const std::string& id);
  // Adds a hull of the store, at rest. Requires that there is none with its ID.
  void AddResting(const StoredHull& stored);
  // Adds a hull that is in use. Requires that there is none with its ID.
  HullPointer Insert(const StoredHull& stored, const HullState& state);
  void Insert(const HullPointer& hull);
  // Requires that it is there.
  void Erase(const HullPointer& hull);

  // Moves the hand by kHullsPerStep, and puts to rest what it finds unused. Cost: O(log n).
  void RestSome();
  static constexpr int kHullsPerStep = 4;

 private:
  bool IsUnused(const HullPointer& hull) const;

  const bool readable_;
  MemoryBudget& budget_;
  Entries entries_;
  std::atomic<size_t> held_ = 0;
  // After the last hull that RestSome looked at.
  std::string hand_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_HULL_TABLE_H_
