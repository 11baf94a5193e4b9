#ifndef HULLD_SERVER_REGISTRY_H_
#define HULLD_SERVER_REGISTRY_H_

#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/hull/hull_builder.h"
#include "server/config.h"
#include "server/snapshot.h"
#include "server/store.h"
#include "server/worker_pool.h"

namespace hulld::server {

// A hull without its geometry, as of its last committed change.
struct HullRecord {
  std::string hull_id;
  // The store's revision at which this incarnation was created.
  uint64_t create_revision = 0;
  // The store's revision of the last change of its vertex set.
  uint64_t revision = 0;
  int dimension = -1;
  uint64_t vertex_count = 0;
  // Sums over all chunks.
  PointCounts counts;
};

// A hull as one reader sees it: the snapshot belongs to the record's revision.
struct HullView {
  HullRecord record;
  std::shared_ptr<const Snapshot> snapshot;
};

// Hulls that all were current at one revision of the store.
struct Resolved {
  uint64_t store_revision = 0;
  // In the order asked for; NOT_FOUND where there is none.
  std::vector<absl::StatusOr<HullView>> hulls;
};

struct CreateResult {
  uint64_t store_revision = 0;
  HullRecord hull;
  bool created = false;
};

struct HullPage {
  uint64_t store_revision = 0;
  std::vector<HullRecord> hulls;
  bool more = false;
};

struct RegistrySizes {
  uint64_t store_revision = 0;
  uint64_t hull_count = 0;
  uint64_t vertex_count = 0;
};

// One chunk of a writer.
struct Chunk {
  uint64_t sequence = 0;
  std::vector<Vector> points;
  // 0: this session created the hull and nothing was appended since.
  std::optional<uint64_t> if_revision;
};

struct ChunkResult {
  uint64_t store_revision = 0;
  bool already_applied = false;
  uint64_t hull_revision = 0;
  uint64_t vertex_count = 0;
  // All zero when already applied.
  PointCounts counts;
};

// One hull and all that belongs to it; known to the registry alone.
struct RegisteredHull;

// One writer's open stream into one incarnation of a hull.
struct AppendSession {
  std::shared_ptr<RegisteredHull> hull;
  std::string writer_id;
  bool created_hull = false;
  uint64_t deletion_watch = 0;
};

struct OpenResult {
  uint64_t store_revision = 0;
  AppendSession session;
  HullRecord hull;
  uint64_t last_sequence = 0;
};

// Keeps hulls by ID: for each a builder, and a snapshot made when the first reader after a change
// asks for it.
//
// One mutex guards all records and is held for moments only; a builder is owned, without the mutex,
// by whoever made it busy: one chunk or one reader that makes a snapshot. A reader takes a current
// snapshot without waiting; one that finds none waits for the chunk in progress at most, since
// waiting readers go before the next chunk. Chunks of one hull queue up and occupy no thread
// meanwhile. Thread-safe.
class Registry {
 public:
  // Chunks are applied on `writers`. Store and pool must outlive this; no call may be running and
  // no chunk be pending when it is destroyed.
  Registry(Store& store, const Limits& limits, WorkerPool& writers);

  const Store& store() const { return store_; }
  const Limits& limits() const { return limits_; }

  // Registers an empty hull. Requires a valid ID.
  // ALREADY_EXISTS; RESOURCE_EXHAUSTED: --max-hulls.
  absl::StatusOr<CreateResult> Create(const std::string& id, bool if_absent);

  // Removes a hull; its sessions hear of it. Returns the store's revision.
  // NOT_FOUND; ABORTED: if_revision does not match.
  absl::StatusOr<uint64_t> Delete(const std::string& id, std::optional<uint64_t> if_revision);

  // At most `page_size` hulls whose IDs start with `prefix` and come after `after`, in byte order.
  HullPage List(const std::string& prefix, const std::string& after, size_t page_size) const;

  RegistrySizes Sizes() const;

  // Snapshots of the hulls, all current at one revision of the store. May wait for chunks in
  // progress and make snapshots, hence not for gRPC's threads.
  // CANCELLED when should_stop said so.
  absl::StatusOr<Resolved> Resolve(std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop);
  // The same, but nullopt, at once, where it would have to wait or to make what is missing.
  std::optional<Resolved> TryResolve(std::span<const std::string> ids);
  // The same for one hull; NOT_FOUND is the status.
  absl::StatusOr<std::pair<uint64_t, HullView>> Resolve(const std::string& id,
                                                        const std::function<bool()>& should_stop);

  // Opens a session. `on_deleted` is called once, on any thread, when the hull is deleted before
  // the session is closed.
  // NOT_FOUND; with create_if_absent RESOURCE_EXHAUSTED: --max-hulls.
  absl::StatusOr<OpenResult> OpenAppend(const std::string& id, const std::string& writer_id,
                                        bool create_if_absent, std::function<void()> on_deleted);

  void CloseAppend(const AppendSession& session);

  // Queues a chunk; `done` is called on a writer thread once it is committed or refused.
  // Refusals, which change nothing: FAILED_PRECONDITION: a gap in the sequence, or the hull was
  // deleted; ABORTED: if_revision does not match; INVALID_ARGUMENT: a point is not finite;
  // RESOURCE_EXHAUSTED: --max-vertices-per-hull, --max-points-per-hull; CANCELLED: should_stop said
  // so.
  void Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
              std::function<void(absl::StatusOr<ChunkResult>)> done);

 private:
  struct PendingChunk;
  friend struct RegisteredHull;
  using HullPointer = std::shared_ptr<RegisteredHull>;
  using Lock = std::unique_lock<std::mutex>;

  HullPointer Find(const std::string& id) const;
  Resolved View(std::span<const std::string> ids, std::span<const HullPointer> hulls) const;
  absl::StatusOr<HullPointer> CreateLocked(const std::string& id);
  void MakeSnapshot(Lock& lock, RegisteredHull& hull, const std::function<bool()>& should_stop);
  void Unpin(const HullPointer& hull);
  void StartNextChunk(const HullPointer& hull);
  void RunNextChunk(const HullPointer& hull);
  absl::StatusOr<ChunkResult> Apply(Lock& lock, RegisteredHull& hull, const PendingChunk& pending,
                                    std::shared_ptr<const Snapshot>* stale);
  absl::Status CommitChunk(RegisteredHull& hull, const PendingChunk& pending,
                           const PointCounts& counts, std::shared_ptr<const Snapshot>* stale);

  Store& store_;
  const Limits limits_;
  WorkerPool& writers_;
  const std::shared_ptr<const Snapshot> empty_snapshot_ = std::make_shared<const Snapshot>(Hull());

  mutable std::mutex mutex_;
  // The rest, and all of a RegisteredHull but its builder, is guarded by mutex_.
  uint64_t revision_ = 0;
  uint64_t vertex_count_ = 0;
  uint64_t last_watch_ = 0;
  std::map<std::string, HullPointer> hulls_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_H_
