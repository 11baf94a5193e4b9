#ifndef HULLD_SERVER_COLLISIONS_WATCHED_HULLS_H_
#define HULLD_SERVER_COLLISIONS_WATCHED_HULLS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/registry/body_resolution.h"
#include "server/registry/registry.h"
#include "server/registry/watch/change_feed.h"

namespace hulld::server {

// The hulls and bodies of a collision watch, with the hulls of the bodies' pieces. Resolves them
// again whenever they change.
//
// Invariant: after each round, all users of a hull use the same version of it, which the client has
// received in this round or an earlier one. Not thread-safe.
class WatchedHulls {
 public:
  // The hulls and bodies resolved together, at one revision of the store.
  struct Round {
    // True if no change is pending; on_ready will then be called once, when a change arrives.
    bool waits = false;
    // Every change up to this revision is included.
    uint64_t revision = 0;
    // True if `revision` is greater than in the previous round.
    bool has_advanced = false;
    // Indices into the IDs, ascending.
    std::vector<size_t> places = {};
    // Parallel to `places`; in the first round, followed by the inline shapes of the lookup.
    Resolved resolved = {};
    // Hulls of pieces whose version is new to the client.
    std::vector<HullRecord> piece_hulls = {};
  };

  // The registry must outlive this object.
  explicit WatchedHulls(Registry& registry) : registry_(registry) {}
  WatchedHulls(const WatchedHulls&) = delete;
  WatchedHulls& operator=(const WatchedHulls&) = delete;
  // Requires Close after Open.
  ~WatchedHulls() = default;

  // Watches these hulls and bodies and resolves all of them. IDs may repeat. on_ready: as in
  // ChangeFeed::Open; may be called before this returns. Requires that it was not called before.
  // Errors: see ChangeFeed::Open, RecordReader::FindBodies, and ResolvePlaced.
  absl::StatusOr<Round> Open(std::span<const std::string> ids, std::function<void()> on_ready,
                             const PlacedLookup& lookup, const std::function<bool()>& should_stop);
  // Resolves the hulls and bodies that changed. Requires that the watch does not wait.
  absl::StatusOr<Round> TakeChanges(const std::function<bool()>& should_stop);
  // Ends the watch. An on_ready that is already due is still called.
  void Close();

  size_t MemoryBytes() const { return piece_bytes_; }

 private:
  struct Version {
    uint64_t create_revision = 0;
    uint64_t revision = 0;

    friend bool operator==(const Version&, const Version&) = default;
  };
  struct Watched {
    // Places of the ID itself, and of bodies with a piece of this hull.
    std::set<size_t> places;
    // Version in use; 0 before the first.
    Version used;
    // Version sent as the hull of a piece; 0 before the first.
    Version sent_as_piece;
  };
  static Version VersionOf(const HullRecord& hull) { return {hull.create_revision, hull.revision}; }

  std::set<size_t> PlacesOf(const WatchBatch& batch) const;
  absl::Status Resolve(std::set<size_t> places, const std::function<bool()>& should_stop,
                       Round* round);
  absl::Status WatchPieces(std::span<const size_t> places, std::span<const std::string> ids,
                           const std::function<bool()>& should_stop);
  void SetPieces(std::span<const size_t> places, std::vector<std::vector<std::string>> hull_ids);
  bool HasWatchedPieces(const Round& round) const;
  void AddOutdatedPlaces(const Resolved& resolved, std::set<size_t>* places) const;
  void UseVersions(Round* round);

  Registry& registry_;
  PlacedLookup lookup_;
  std::shared_ptr<Watch> watch_;
  std::vector<std::string> ids_;
  // By place: the hulls of a body's pieces, each once; empty for a hull.
  std::vector<std::vector<std::string>> pieces_;
  // By ID.
  std::unordered_map<std::string, Watched> hulls_;
  size_t piece_bytes_ = 0;
  uint64_t revision_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_COLLISIONS_WATCHED_HULLS_H_
