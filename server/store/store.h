#ifndef HULLD_SERVER_STORE_STORE_H_
#define HULLD_SERVER_STORE_STORE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/hull/hull.h"
#include "server/store/records.h"

namespace hulld::server {

// Durability of a committed change.
enum class Durability {
  kMemory,   // lost when the server ends
  kRelaxed,  // survives a crash of the server, but a crash of the machine only after some time
  kSync,     // on disk: survives both
};

struct WriterSequence {
  std::string writer_id;
  uint64_t sequence = 0;

  friend bool operator==(const WriterSequence&, const WriterSequence&) = default;
};

// The effect of a change on the stored vertices of its hull.
enum class VertexChange {
  kNone,
  // Appends Change::vertices as a delta.
  kAdded,
  // Replaces all stored vertices with Change::vertices, the new base.
  kReplaced,
};

// A hull or body that is created, changed, or deleted. The store assigns the revisions as it
// commits the change (NumberChanges). Until then the revisions in `hull`, in its layouts, and in
// `body` have no meaning, except the revisions of a deleted or replaced hull.
struct Change {
  // The hull after the change, or the deleted hull.
  StoredHull hull;
  // The store's revision after the change; hull.record.revision is lower if no vertex changed.
  uint64_t revision = 0;
  // True if the change gets a new revision. False for points that change no vertex.
  bool takes_revision = true;
  // True if this is a new incarnation of the hull, or the first version of the body.
  bool begins = false;
  bool deleted = false;
  // For a body that begins: true if it replaces a body, for example a damaged one.
  bool replaces_body = false;
  // For a change within an incarnation: the hull's revisions after all batches before this one.
  std::shared_ptr<const HullRevisions> before;
  // For a change within an incarnation: the number of vertices before the change.
  uint64_t previous_vertices = 0;
  // Layout of the hull's vertices before the change.
  VertexLayout previous_layout;
  VertexChange vertex_change = VertexChange::kNone;
  std::vector<Vector> vertices;
  // The writer, if the change is a chunk.
  std::optional<WriterSequence> writer;
  // The hull that this incarnation replaces, if any.
  std::optional<StoredHull> replaced;
  // The body after the change, or the deleted body. If set, the fields about a hull are unused.
  std::shared_ptr<StoredBody> body;

  const std::string& id() const {
    return body != nullptr ? body->record.body_id : hull.record.hull_id;
  }
};

// Assigns revisions to changes, in order, in their records, layouts, and bodies. revision: the
// store's revision before the first change. Returns the revision after the last. Can be repeated
// with another revision until the changes are committed. Cost: O(1) each.
uint64_t NumberChanges(std::span<Change* const> changes, uint64_t revision);

// Changes to an ID by peer servers.
struct PeerChange {
  // Revision of the latest change: of the current hull or body, or of its end.
  uint64_t revision = 0;
  // Revision at which the latest incarnation ended; 0: none ended.
  uint64_t ended_at = 0;
  // First incarnation that ended; nullopt if none ended or it is unknown.
  std::optional<Incarnation> previous;
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
  // Totals at that revision, if Store::supports_lookup().
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

// Receives the ID of a stored hull, and its record, or DATA_LOSS naming the hull if the record is
// damaged.
using StoredHullVisitor = std::function<void(const std::string&, absl::StatusOr<StoredHull>)>;

// Receives a stored body in the same way.
using StoredBodyVisitor = std::function<void(const std::string&, absl::StatusOr<StoredBody>)>;

// Records of hulls and bodies at one revision.
struct FoundRecords {
  // The store's revision.
  uint64_t revision = 0;
  // Existing records by ID, or DATA_LOSS naming the hull or body.
  std::map<std::string, absl::StatusOr<StoredHull>> hulls;
  std::map<std::string, absl::StatusOr<StoredBody>> bodies;
  // For a list: true if more records follow.
  bool more = false;
};

// Kinds of records in a list.
struct RecordKinds {
  bool hulls = false;
  bool bodies = false;
};

// Failed operations so far, each counted once, by the system call that failed.
struct StoreFailures {
  // Writes, and reopening the store after an error.
  uint64_t write = 0;
  uint64_t sync = 0;
  // Failed reads. Damaged values that could be read do not count.
  uint64_t read = 0;
};

// Disk usage and write stalls.
struct StoreDisk {
  // Bytes of all files, including the log.
  uint64_t bytes = 0;
  uint64_t log_bytes = 0;
  // Free bytes of the disk, if known.
  std::optional<uint64_t> free_bytes;
  // Number of times that changes were slowed down or stopped since the store was opened
  // (monotonic), and the current state.
  uint64_t stalls = 0;
  bool is_stalled = false;
};

// Stores committed changes for the registry. Reads may run on any thread.
class Store {
 public:
  virtual ~Store() = default;

  // The value of --store.
  virtual std::string kind() const = 0;
  // A random ID, one per store.
  virtual const std::string& id() const = 0;
  virtual Durability durability() const = 0;
  // True if hulls can be read back, so that the registry may evict its copies.
  virtual bool keeps_hulls() const = 0;
  // The last committed revision. Not concurrent with Commit.
  virtual uint64_t revision() const = 0;

  // Visits every hull, then every body, each in byte order of the IDs. By default, lists all
  // records page by page.
  virtual absl::Status ForEachRecord(const StoredHullVisitor& visit_hull,
                                     const StoredBodyVisitor& visit_body);
  // Returns points with the convex hull `hull`. DATA_LOSS naming the hull: values are missing or
  // damaged.
  virtual absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) = 0;
  // Returns LoadVertices of each hull, in order. Keeps all results in memory until it returns.
  virtual std::vector<absl::StatusOr<std::vector<Vector>>> LoadVerticesOfEach(
      std::span<const StoredHull> hulls) {
    std::vector<absl::StatusOr<std::vector<Vector>>> loaded;
    loaded.reserve(hulls.size());
    for (const StoredHull& hull : hulls) loaded.push_back(LoadVertices(hull));
    return loaded;
  }
  // Returns the writer's last committed sequence, or 0.
  virtual absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                                const std::string& writer_id) = 0;

  // True if the store can look up single records at low cost, so that they need not all be read at
  // startup. The results of the next two functions include everything committed before the call, by
  // any server. UNAVAILABLE: the store cannot be read.
  virtual bool supports_lookup() const { return false; }
  // Returns the hulls and bodies with these IDs.
  virtual absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> /*ids*/) {
    return absl::UnimplementedError("this store does not support record lookups");
  }
  // Returns up to `limit` records of these kinds in byte order, with IDs that start with `prefix`
  // and follow `after`. Returns fewer, but at least one, if they exceed kMaxListedBytes.
  virtual absl::StatusOr<FoundRecords> ListRecords(const std::string& /*prefix*/,
                                                   const std::string& /*after*/, size_t /*limit*/,
                                                   RecordKinds /*kinds*/) {
    return absl::UnimplementedError("this store does not support record lookups");
  }
  static constexpr uint64_t kMaxListedBytes = 16 << 20;
  // Totals at revision(), if supports_lookup(). Not concurrent with Commit.
  virtual StoreTotals totals() const { return {}; }

  // Returns the writers of the hull in byte order of the IDs. FAILED_PRECONDITION: the store is in
  // memory.
  virtual absl::StatusOr<std::vector<WriterSequence>> LoadWriters(const StoredHull& /*hull*/) {
    return absl::FailedPreconditionError("this store does not keep writers");
  }

  // Assigns revisions to a batch of changes and commits it atomically, before any reader sees it.
  // Calls are sequential, in commit order. On an error, the whole batch is refused and the store
  // unchanged, even for a process that opens it after this one was killed. Exception: UNAVAILABLE
  // with a message that the outcome is unknown. Until Recover succeeds, the next process may then
  // find the batch. RESOURCE_EXHAUSTED: the disk is full; a batch of deletions alone may succeed.
  virtual absl::Status Commit(std::span<Change* const> changes) = 0;
  // Makes Commit possible again after an error, or returns the cause. Not concurrent with Commit.
  virtual absl::Status Recover() = 0;

  virtual StoreFailures failures() const { return {}; }

  // None for a store without files. Cost: O(files), about 10 us each.
  virtual std::optional<StoreDisk> disk() const { return std::nullopt; }

  // Makes a consistent copy of the store at some revision during the call. Returns its directory,
  // which the caller removes. FAILED_PRECONDITION: the store is in memory.
  virtual absl::StatusOr<std::string> MakeCopy() = 0;

  // The commits of peer servers; null if no other server can commit to this store.
  virtual PeerFeed* peers() { return nullptr; }

  // Registers a callback that runs, on any thread, when a peer has taken over the store, so that
  // this server can neither commit nor read; immediately if that has already happened. The process
  // must then end.
  virtual void OnEnded(std::function<void()> /*ended*/) {}

  // Returns true if the next change should write a new base instead of a delta of `new_vertices`:
  // the deltas have outgrown the base. This limits the size of all bases to a few times the size of
  // all deltas. A stored delta costs kDeltaBytes in addition to its vertices.
  static bool WantsBase(const VertexLayout& layout, uint64_t new_vertices) {
    constexpr uint64_t kDeltaBytes = 64;
    constexpr uint64_t kSmallBytes = 64 << 10;
    const uint64_t base = layout.base_vertices * sizeof(Vector);
    const uint64_t deltas = (layout.delta_vertices + new_vertices) * sizeof(Vector) +
                            (layout.delta_count + 1) * kDeltaBytes;
    return deltas > (base > kSmallBytes ? base : kSmallBytes);
  }
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_STORE_H_
