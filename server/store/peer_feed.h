#ifndef HULLD_SERVER_STORE_PEER_FEED_H_
#define HULLD_SERVER_STORE_PEER_FEED_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/numeric/vector.h"
#include "server/store/records.h"

namespace hulld::server {

// Changes to an ID by peer servers.
struct PeerChange {
  // Revision of the latest change: of the current hull or body, or of its end.
  uint64_t revision = 0;
  // Revision at which the latest incarnation ended; 0: none ended.
  uint64_t ended_at = 0;
  // create_revision of the first incarnation that ended, or 0 if none ended or it is unknown; and
  // its kind.
  uint64_t former_began = 0;
  bool former_was_body = false;
  // The current hull or body, if any. DATA_LOSS: it is damaged.
  std::optional<absl::StatusOr<StoredHull>> hull;
  std::optional<absl::StatusOr<StoredBody>> body;
  // Points that grow the known version of the hull into the current one (LoadGrowth). None: the
  // hull must be read again.
  std::optional<std::vector<Vector>> growth;
};

// Numbers of stored objects.
struct StoreTotals {
  uint64_t hulls = 0;
  uint64_t vertices = 0;
  uint64_t bodies = 0;
};

// Changes that peer servers committed, up to a revision.
struct PeerChanges {
  // That revision; 0: no new changes.
  uint64_t revision = 0;
  std::map<std::string, PeerChange> by_id;
  // Totals at that revision, if Store::finds_records().
  StoreTotals totals;
};

// The commits of peer servers to the same store (Store::peers).
//
// With a feed, Store::Commit skips changes to every ID in the next result of TakeChanges, because
// they are based on a stale state. LoadVertices and LoadSequence return ABORTED for a hull that
// changed since.
class PeerFeed {
 public:
  virtual ~PeerFeed() = default;

  // Fetches the changes that peer servers committed before the call. Not concurrent with Commit or
  // Recover. UNAVAILABLE: the store cannot be reached.
  virtual absl::Status Fetch() = 0;
  // Sends the query of the next Fetch, which then returns the changes committed before this call.
  // Does not block, so any thread may call it. Fetch must follow before the next Commit or Recover.
  // If the query cannot be sent now, Fetch sends it.
  virtual void StartFetch() {}
  // Returns the peer changes that Commit and Fetch have found since the last call, even if they
  // failed.
  virtual PeerChanges TakeChanges() = 0;
  // Returns for each hull the points of its deltas between the two versions, in order; none if the
  // deltas are gone, for example after a new base, or cannot be read. Sends one query for all
  // hulls. Not concurrent with Commit, Recover, or Fetch.
  virtual std::vector<std::optional<std::vector<Vector>>> LoadGrowth(
      std::span<const HullGrowth> hulls) {
    return std::vector<std::optional<std::vector<Vector>>>(hulls.size());
  }
  // Registers a callback that runs, on any thread, soon after a peer server commits: a hint to
  // fetch. Empty: none. Blocks until the previous callback has returned.
  virtual void OnPeerCommit(std::function<void()> /*committed*/) {}
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_PEER_FEED_H_
