#ifndef HULLD_SERVER_REGISTRY_CATALOG_BODY_TABLE_H_
#define HULLD_SERVER_REGISTRY_CATALOG_BODY_TABLE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/registry/catalog/body.h"
#include "server/registry/memory/locked.h"

namespace hulld::server {

// Bodies of a registry by ID, including their pieces.
//
// If the store finds records, this is a cache: an ID without an entry is unknown, unless the hull
// table knows its hull or its absence. Bodies range from a few hundred bytes to
// --max-pieces-per-body pieces, so the bound is in bytes. Eviction removes unreferenced bodies,
// least recently used first.
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

  // Makes this a cache of at most `bytes`, exceeded only by entries in use. Requires an empty
  // table.
  void KeepAtMost(uint64_t bytes) { most_ = bytes; }

  size_t size() const { return entries_.size(); }
  bool contains(const std::string& id) const { return entries_.contains(id); }
  // Entries in the byte order of the IDs.
  const Entries& entries() const { return entries_; }
  // Returns null if there is no body or the ID is unknown. Cost: O(log n).
  Entry* Find(const std::string& id);
  // As Find, but adds an entry without a body if there is none.
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
  // Limit in bytes; set if this is a cache.
  std::optional<uint64_t> most_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_BODY_TABLE_H_
