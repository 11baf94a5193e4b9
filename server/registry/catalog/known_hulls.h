#ifndef HULLD_SERVER_REGISTRY_CATALOG_KNOWN_HULLS_H_
#define HULLD_SERVER_REGISTRY_CATALOG_KNOWN_HULLS_H_

#include <absl/container/flat_hash_map.h>
#include <absl/hash/hash.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/registry/catalog/registry_types.h"

namespace hulld::server {

// Recent reader-visible changes of hulls, in order, each stored as a hash of the ID. Not
// thread-safe.
class RecentChanges {
 public:
  // Maximum number of changes: half a megabyte when full.
  static constexpr uint64_t kCapacity = 1 << 16;

  // Differs between processes, so that no client can craft a request of IDs with equal hashes.
  static uint64_t HashOf(std::string_view id) { return absl::HashOf(id); }

  void Note(std::string_view id) {
    if (end_ < kCapacity) {
      hashes_.push_back(HashOf(id));
    } else {
      hashes_[end_ % kCapacity] = HashOf(id);
    }
    ++end_;
  }
  // Position after the last change.
  uint64_t end() const { return end_; }
  // Returns true if all changes from this position on are retained.
  bool Knows(uint64_t change) const { return end_ - change <= kCapacity; }
  uint64_t at(uint64_t change) const { return hashes_[change % kCapacity]; }

 private:
  std::vector<uint64_t> hashes_;
  uint64_t end_ = 0;
};

// State that a reader keeps about the hulls that it requests: each hull once, regardless of how
// often it is named, and the hulls that must be looked up because they changed. A reader that
// repeats its request keeps this between calls (HullReader::Refresh). Not thread-safe.
class KnownHulls {
 public:
  // for_one_lookup: a single lookup, which moves the views into its result instead of copying them.
  explicit KnownHulls(bool for_one_lookup = false) : is_for_one_lookup_(for_one_lookup) {}

  // Sets the IDs; all hulls must be looked up. Does nothing after the first call: the IDs stay the
  // same. Cost: O(n).
  void Begin(std::span<const std::string> ids);

  // Number of hulls, each ID counted once.
  size_t size() const { return hulls_.size(); }

 private:
  friend class HullReader;

  // Not an index into hulls_.
  static constexpr uint32_t kNone = UINT32_MAX;
  struct Known {
    // Index of the ID's first occurrence in the request.
    uint32_t first = 0;
    // The next hull with the same hash.
    uint32_t same_hash = kNone;
    bool is_due = false;
    bool is_prepared = false;
    // True if it was read from the store for this lookup, together with others.
    bool is_loaded = false;
    // Hull found when the read began; null if it must be looked up.
    HullPointer found;
    // Approximate bytes of the hull that this entry keeps in memory.
    uint64_t bytes = 0;
    // UNKNOWN until the hull is looked up; without a message, to avoid an allocation.
    absl::StatusOr<HullView> view = absl::Status(absl::StatusCode::kUnknown, "");
  };

 public:
  // Approximate bytes per ID, excluding the ID itself and the hull.
  static constexpr size_t kBytesEach =
      sizeof(Known) + 2 * sizeof(uint32_t) + 2 * sizeof(std::pair<uint64_t, uint32_t>);

 private:
  // Marks every hull for lookup.
  void ForgetAll();
  // Marks for lookup all hulls that a change with this hash may affect. Cost: O(1).
  void NoteChange(uint64_t hash);
  void MakeDue(uint32_t hull);
  // Marks hulls with failed reads for lookup, and all hulls as unprepared.
  void BeginLookup();
  // Approximate bytes of the hulls that all entries keep in memory.
  uint64_t HullBytes() const;
  // Returns the views in the order of the request.
  std::vector<absl::StatusOr<HullView>> Views(std::span<const std::string> ids);

  bool is_for_one_lookup_;
  bool has_begun_ = false;
  std::vector<Known> hulls_;
  // Index of the hull of each requested ID.
  std::vector<uint32_t> hull_of_;
  // The first hull with each hash of an ID.
  absl::flat_hash_map<uint64_t, uint32_t> by_hash_;
  // Hulls to look up; processed from the back.
  std::vector<uint32_t> due_;
  // Changes before this position were applied; empty before the first lookup.
  std::optional<uint64_t> next_change_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_KNOWN_HULLS_H_
