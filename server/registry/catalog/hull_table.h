#ifndef HULLD_SERVER_REGISTRY_CATALOG_HULL_TABLE_H_
#define HULLD_SERVER_REGISTRY_CATALOG_HULL_TABLE_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/registry/catalog/hull_state.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/memory_budget.h"
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
// Where the store finds records, this is a cache of them, and of IDs of which it is known that
// there is neither hull nor body: what is not here is not known. The hand then drops what it finds
// at rest, and not looked for since it came by last, once there is more than was asked for.
//
// Guarded by the registry's mutex.
class HullTable {
 public:
  using HullPointer = std::shared_ptr<RegisteredHull>;

  // About what a record takes, with its ID. Bytes.
  static constexpr uint64_t kBytesOfRecord = 320;

  // readable: whether the store gives back what it keeps of hulls. The budget must outlive this.
  HullTable(bool readable, MemoryBudget& budget) : readable_(readable), budget_(budget) {}

  // This is a cache of so many records, and of more only where they are in use. Before the first.
  void KeepAtMost(size_t records) { most_ = records; }

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

    // Null: at rest, or there is none.
    HullPointer awake_;
    RestingHull resting_;
    bool is_absent_ = false;
    // Looked for since the hand came by.
    bool is_used_ = false;
  };
  using Entries = std::map<std::string, Entry>;

  // How many hulls are here; any thread.
  size_t size() const { return size_.load(std::memory_order_relaxed); }
  bool contains(const std::string& id) const;
  bool IsVisible(const std::string& id) const;
  // Whether it is known what there is, or that there is nothing. A cache does not know what is not
  // here; otherwise that is not there.
  bool Knows(const std::string& id) const { return !is_cache() || entries_.contains(id); }
  // For walks in the byte order of the IDs. Of a cache, also those of which there is none.
  const Entries& entries() const { return entries_; }

  // The hull, no longer at rest; null when there is none; nothing when that is not known. Cost:
  // O(log n).
  std::optional<HullPointer> Ask(const std::string& id);
  // The same; null also when it is not known.
  HullPointer Find(const std::string& id) { return Ask(id).value_or(nullptr); }
  // Adds a hull of the store, at rest. Requires that there is none with its ID.
  void AddResting(const StoredHull& stored);
  // There is nothing under this ID. Requires that nothing is known.
  void NoteAbsent(const std::string& id);
  // A body has the ID, so that there is no hull while that is known (BodyTable), but something.
  void ForgetAbsent(const std::string& id);
  // Adds a hull that is in use. Requires that there is none with its ID.
  HullPointer Insert(const StoredHull& stored, const HullState& state);
  void Insert(const HullPointer& hull);
  // Requires that it is there. From then on it is known that there is none.
  void Erase(const HullPointer& hull);

  // Moves the hand by kHullsPerStep, and puts to rest what it finds unused; a cache drops what is
  // too much. Cost: O(log n).
  void RestSome();
  static constexpr int kHullsPerStep = 4;

 private:
  bool is_cache() const { return most_.has_value(); }
  Entry& Add(const std::string& id);
  bool IsUnused(const HullPointer& hull) const;

  const bool readable_;
  MemoryBudget& budget_;
  Entries entries_;
  // Those that are hulls.
  std::atomic<size_t> size_ = 0;
  // Set: a cache of so many.
  std::optional<size_t> most_;
  // After the last hull that RestSome looked at.
  std::string hand_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_HULL_TABLE_H_
