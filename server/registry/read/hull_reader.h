#ifndef HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
#define HULLD_SERVER_REGISTRY_READ_HULL_READER_H_

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/process/metrics.h"
#include "server/process/task_pool.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/peers/peer_sync.h"
#include "server/registry/records/record_reader.h"
#include "server/registry/state/registry_state.h"

namespace hulld::server {

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

// Returns hulls ready to be served, all at one revision.
//
// A read releases the mutex after every kMaxLookupsPerHold lookups. At the end, it looks up the
// hulls that have changed since, until all that remain fit into one critical section: all hulls are
// then at one revision. This terminates, because a commit takes longer than a lookup. Readers and
// writers never wait for each other: a reader gets the version of the committed state, created in
// O(1), and never uses a builder.
//
// A read waits only for the store: for the record of an unknown hull (RecordReader), and for points
// that are not in memory. One reader loads a hull for all that request it
// (RegisteredHull::is_loading). Other threads help a read that loads many hulls. A read finishes
// its own loads before it waits for another read, because the other read may be waiting for them.
//
// Guarded by the registry's mutex, which this class acquires, and releases to wait and to prepare.
class HullReader {
 public:
  // All must outlive this. loaders: threads that help readers of many hulls.
  HullReader(RegistryState& state, PeerSync& peers, RecordReader& records, TaskPool& loaders)
      : state_(state), peers_(peers), records_(records), loaders_(loaders) {}
  HullReader(const HullReader&) = delete;
  HullReader& operator=(const HullReader&) = delete;

  // Like Registry::Resolve, for a caller that repeatedly requests the same hulls: `known` persists
  // between calls, and only hulls changed since are looked up.
  absl::StatusOr<Resolved> Refresh(std::span<const std::string> ids, KnownHulls& known,
                                   const std::function<bool()>& should_stop,
                                   const ReadPlan& plan = {});
  // Returns the canonical snapshot of a resolved hull, built at first use; it lives as long as
  // view.served. Not for gRPC threads. DATA_LOSS: the store is damaged. CANCELLED: should_stop
  // returned true. RESOURCE_EXHAUSTED: it is not built yet, and readers exceed their share of
  // --memory-limit. Cost: building the hull.
  absl::StatusOr<const Hull*> Canonical(const HullView& view,
                                        const std::function<bool()>& should_stop);
  // Sets the histogram of snapshot build times. Call before the first; it must outlive this.
  void SetMetrics(prometheus::Histogram& snapshot_seconds) {
    snapshot_seconds_ = &snapshot_seconds;
  }

 private:
  struct HullsRead;

  absl::Status LookUpAll(Locked& locked, const HullsRead& read);
  size_t FindAhead(const HullsRead& read);
  absl::Status LookUp(Locked& locked, const HullsRead& read, uint32_t k);
  static absl::Status NoteFailure(const absl::Status& status, KnownHulls::Known& known);
  absl::Status AwaitRecord(Locked& locked, const HullsRead& read, uint32_t k);
  static bool IsHeld(const KnownHulls::Known& known, const RegisteredHull& hull);
  void NoteView(Locked& locked, const HullPointer& hull, KnownHulls& hulls, uint32_t k,
                bool was_missing);
  absl::Status CheckReaders(Locked& locked, const KnownHulls& known);

  void LoadMany(Locked& locked, const HullsRead& read);
  absl::Status LoadOne(Locked& locked, RegisteredHull& hull,
                       const std::function<bool()>& should_stop);

  RegistryState& state_;
  PeerSync& peers_;
  RecordReader& records_;
  TaskPool& loaders_;
  // May be null.
  prometheus::Histogram* snapshot_seconds_ = nullptr;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_READ_HULL_READER_H_
