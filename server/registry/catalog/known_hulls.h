#ifndef HULLD_SERVER_REGISTRY_CATALOG_KNOWN_HULLS_H_
#define HULLD_SERVER_REGISTRY_CATALOG_KNOWN_HULLS_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/hull_loader.h"

namespace hulld::server {

struct RegisteredHull;

// The last changes of what readers are given of hulls, in their order, each as a hash of the hull's
// ID. Not thread-safe.
class RecentChanges {
 public:
  // Half a megabyte, once there were as many.
  static constexpr uint64_t kMost = 1 << 16;

  static uint64_t HashOf(std::string_view id) { return std::hash<std::string_view>()(id); }

  void Note(std::string_view id) {
    if (end_ < kMost) {
      hashes_.push_back(HashOf(id));
    } else {
      hashes_[end_ % kMost] = HashOf(id);
    }
    ++end_;
  }
  // After the last change.
  uint64_t end() const { return end_; }
  // Whether all changes from this one on are known.
  bool Knows(uint64_t change) const { return end_ - change <= kMost; }
  uint64_t at(uint64_t change) const { return hashes_[change % kMost]; }

 private:
  std::vector<uint64_t> hashes_;
  uint64_t end_ = 0;
};

// What a reader knows of the hulls that it asks for: each once, however often it is named, and
// which of them must be looked up because they changed since. A reader that asks again and again
// keeps it (Registry::Resolve). Not thread-safe.
class KnownHulls {
 public:
  KnownHulls() = default;

  // Begins with these IDs, of which nothing is known, so that all must be looked up; does nothing
  // when it has begun. They stay the same. Cost: O(n log n).
  void Begin(std::span<const std::string> ids);

  // Hulls by index: each ID once.
  size_t size() const { return hulls_.size(); }
  // How many were looked up so far; where it is the same as before, nothing of them has changed
  // meanwhile, what there is none of included.
  uint64_t lookups() const { return lookups_; }

 private:
  friend class HullReader;

  struct Known {
    // Where the ID is among those asked for.
    uint32_t first = 0;
    bool is_due = false;
    bool is_prepared = false;
    // It was read from the store for this lookup, with others; or it is among those that are.
    bool is_loaded = false;
    bool is_ahead = false;
    // What was found when that began; null where it must be looked for.
    std::shared_ptr<RegisteredHull> found;
    // About what it holds of the hull.
    uint64_t bytes = 0;
    absl::StatusOr<HullView> view = absl::UnknownError("not looked up");
  };

  // Hulls that are read from the store before they are looked up.
  struct Loading {
    std::shared_ptr<LoadJob> job;
    // Each hull of it, and its index here.
    std::vector<std::shared_ptr<RegisteredHull>> found;
    std::vector<uint32_t> hulls;
    uint64_t points = 0;
  };

 public:
  // About what it holds of each ID, in bytes, the ID and the hull apart.
  static constexpr size_t kBytesEach =
      sizeof(Known) + 2 * sizeof(uint32_t) + sizeof(std::pair<uint64_t, uint32_t>);

 private:
  // Every hull must be looked up.
  void ForgetAll();
  // Those that a change with this hash may have been of must be looked up. Cost: O(log n).
  void NoteChange(uint64_t hash);
  void MakeDue(uint32_t hull);
  // Looks again for what could not be read, and begins to prepare anew.
  void BeginLookup();
  // About what is held of all hulls.
  uint64_t HullBytes() const;
  // In the order asked for.
  std::vector<absl::StatusOr<HullView>> Views(std::span<const std::string> ids) const;

  bool has_begun_ = false;
  uint64_t lookups_ = 0;
  std::vector<Known> hulls_;
  // The hull of each ID asked for.
  std::vector<uint32_t> hull_of_;
  // By the hash of their IDs.
  std::vector<std::pair<uint64_t, uint32_t>> by_hash_;
  // Those that must be looked up; the last one comes first.
  std::vector<uint32_t> due_;
  // What is read from the store, in the order in which it is due; none between lookups.
  std::deque<Loading> ahead_;
  // The hulls of due_ from here on were looked through for what is to be read.
  size_t ahead_end_ = 0;
  // Changes before this one were taken into account; none at first.
  std::optional<uint64_t> next_change_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_KNOWN_HULLS_H_
