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

// The bodies of a registry, by ID; of each all that is known, its pieces.
//
// Where the store finds records, this is a cache of them: what is not here is not known, unless the
// table of hulls knows that there is a hull, or nothing, under the ID. Bodies differ in size, from
// a few hundred bytes to --max-pieces-per-body, so a number of bytes bounds it. Those that nobody
// holds go first that were not looked for since longest.
//
// Guarded by the registry's mutex.
class BodyTable {
 public:
  // What is known of an ID that is, or is about to be, a body's.
  struct Entry {
    // Null until the first is committed.
    const std::shared_ptr<const Body>& committed() const { return body_; }
    // Whether nothing would be lost with it but what the store finds again.
    bool IsUnused() const { return !in_flight && waiting.empty() && body_.use_count() == 1; }

    // A change of it is submitted and neither committed nor refused; others wait for that.
    bool in_flight = false;
    std::deque<std::function<void(Locked&)>> waiting;

   private:
    friend class BodyTable;

    std::shared_ptr<const Body> body_;
    // In used_.
    std::list<const std::string*>::iterator place_;
  };
  using Entries = std::map<std::string, Entry>;

  // About what an entry takes beside the pieces and names of its body. Bytes.
  static constexpr uint64_t kBytesOfEntry = 512;

  // This is a cache of so many bytes, and of more only where they are in use. Before the first.
  void KeepAtMost(uint64_t bytes) { most_ = bytes; }

  size_t size() const { return entries_.size(); }
  bool contains(const std::string& id) const { return entries_.contains(id); }
  // For walks in the byte order of the IDs.
  const Entries& entries() const { return entries_; }
  // Null: there is none, or that is not known. Cost: O(log n).
  Entry* Find(const std::string& id);
  // The same; adds one without a body where there is none.
  Entry& Add(const std::string& id);
  // What is committed from now on; null for none. Requires that it is here.
  void Set(Locked& locked, const std::string& id, std::shared_ptr<const Body> body);
  // Requires that it is here.
  void Erase(Locked& locked, const std::string& id);

  // A cache drops what is too much. Cost: O(log n) for each body that goes.
  void DropSome(Locked& locked);
  // Bodies that are in use, which it looks at in vain at a time, at most: a microsecond.
  static constexpr int kMostAsked = 16;

 private:
  static uint64_t BytesOf(const Entry& entry);

  Entries entries_;
  // The last used in front.
  std::list<const std::string*> used_;
  uint64_t bytes_ = 0;
  // Set: a cache of so many bytes.
  std::optional<uint64_t> most_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_BODY_TABLE_H_
