#ifndef HULLD_SERVER_REGISTRY_REGISTRY_H_
#define HULLD_SERVER_REGISTRY_REGISTRY_H_

#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "server/process/metrics.h"
#include "server/process/worker_pool.h"
#include "server/registry/served_hull.h"
#include "server/settings/config.h"
#include "server/store/hull_record.h"
#include "server/store/store.h"

namespace hulld::server {

// A hull as one reader sees it: the snapshot belongs to the record's revision.
struct HullView {
  HullRecord record;
  std::shared_ptr<const ServedHull> served;
};

// Hulls that all were current at one revision of the store.
struct Resolved {
  uint64_t store_revision = 0;
  // In the order asked for; NOT_FOUND where there is none, DATA_LOSS where the store is damaged.
  std::vector<absl::StatusOr<HullView>> hulls;
};

struct CreateResult {
  uint64_t store_revision = 0;
  HullRecord hull;
  bool created = false;
};

struct ReplaceResult {
  uint64_t store_revision = 0;
  HullRecord hull;
  // Whether there was none before.
  bool created = false;
};

// What takes the place of a hull.
struct Replacement {
  std::string hull_id;
  // 0: the hull must not exist.
  std::optional<uint64_t> if_revision;
  bool create_if_absent = false;
  std::shared_ptr<HullBuilder> builder;
  // Sums over the points that the builder was given.
  PointCounts counts;
  // The builder's, for the store; Registry::Replace fills it.
  std::vector<Vector> vertices = {};
};

struct ListedHull {
  HullRecord record;
  // The store cannot read it; of a damaged record no more than the ID is known.
  bool damaged = false;
};

struct HullPage {
  uint64_t store_revision = 0;
  std::vector<ListedHull> hulls;
  bool more = false;
};

struct RegistrySizes {
  uint64_t store_revision = 0;
  uint64_t hull_count = 0;
  uint64_t vertex_count = 0;
};

// What the registry holds of hulls in memory, and how that served so far.
struct CacheStatistics {
  // Builders and snapshots; points that wait to be built, and vertices that wait for the store; and
  // what calls hold for long (MemoryCharge).
  uint64_t bytes = 0;
  uint64_t limit_bytes = 0;
  // Hulls that a reader asked for and whose snapshot was there.
  uint64_t hits = 0;
  // Those whose snapshot had to be made.
  uint64_t misses = 0;
  // Hulls read back from the store.
  uint64_t loads = 0;
  // Builders and snapshots dropped to stay within the limit.
  uint64_t evictions = 0;
  // Hulls found damaged in the store.
  uint64_t damaged = 0;
};

// How changes reached the store so far.
struct CommitStatistics {
  uint64_t batches = 0;
  uint64_t changes = 0;
  uint64_t failed_batches = 0;
  // The last batch failed.
  bool failing = false;
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
  uint64_t watch = 0;
};

struct OpenResult {
  uint64_t store_revision = 0;
  AppendSession session;
  HullRecord hull;
  uint64_t last_sequence = 0;
};

template <typename T>
using Reply = std::function<void(absl::StatusOr<T>)>;

class Registry;

// What a call holds for long, of a hull that the registry does not know yet or of placements and
// pairs, counted against --memory-limit until this goes. Not thread-safe; the registry must outlive
// it.
class MemoryCharge {
 public:
  explicit MemoryCharge(Registry& registry) : registry_(registry) {}
  MemoryCharge(const MemoryCharge&) = delete;
  MemoryCharge& operator=(const MemoryCharge&) = delete;
  ~MemoryCharge() { Set(0); }

  // What it holds now.
  void Set(uint64_t bytes);

 private:
  Registry& registry_;
  uint64_t bytes_ = 0;
};

// Keeps hulls by ID: for each its record, and, while it is in use or memory allows, a builder and
// the snapshot that the first reader after a change asked for. What is not in memory is read back
// from the store at first use.
//
// Changes are made in two steps. A chunk is built first; the change that it makes then joins the
// queue of one committer thread, which hands all that waits to the store as one batch (group
// commit). Only when that is kept does a change become visible, as a whole and in the order of the
// queue, and is answered. Meanwhile the next chunk of the same hull may be built upon it: should
// the batch fail, so do all changes that follow it, and the hull returns to its last committed
// state. Creation, deletion, replacement and chunks with a condition on the revision wait until no
// change of their hull is on its way, since what they find must be committed.
//
// One mutex guards all records and is held for moments only; a builder is owned, without the mutex,
// by whoever made the hull busy: one chunk, or one reader that makes a snapshot. A reader takes a
// current snapshot without waiting; one that finds none waits for the chunk in progress and its
// commit at most, since waiting readers go before the next chunk. Chunks of one hull queue up and
// occupy no thread meanwhile. Thread-safe.
class Registry {
 public:
  // Chunks are applied on `writers`. Store and pool must outlive this; no call may be running and
  // no chunk be pending when it is destroyed.
  Registry(Store& store, const Limits& limits, WorkerPool& writers);
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;
  ~Registry();

  // Reads the records of all hulls that the store holds; before any other call. Damaged ones are
  // logged, and answered with DATA_LOSS later.
  absl::Status Load();

  const Store& store() const { return store_; }
  const Limits& limits() const { return limits_; }

  // Registers an empty hull and calls `done` once that is committed or refused, on this or another
  // thread. Requires a valid ID.
  // ALREADY_EXISTS; RESOURCE_EXHAUSTED: --max-hulls, or the disk is full; UNAVAILABLE: the store
  // cannot be written.
  void Create(const std::string& id, bool if_absent, Reply<CreateResult> done);

  // Removes a hull; its sessions hear of it. Replies with the store's revision, as above.
  // NOT_FOUND; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED, UNAVAILABLE: as above.
  void Delete(const std::string& id, std::optional<uint64_t> if_revision, Reply<uint64_t> done);

  // Puts a hull in the place of another, at once for all readers. It is a new incarnation: sessions
  // of the former one end. Replies as above. Copies the vertices, hence not for gRPC's threads.
  // NOT_FOUND, unless create_if_absent; ABORTED: if_revision does not match; RESOURCE_EXHAUSTED:
  // --max-hulls, or the disk is full; UNAVAILABLE: as above.
  void Replace(Replacement replacement, Reply<ReplaceResult> done);

  // At most `page_size` hulls whose IDs start with `prefix` and come after `after`, in byte order.
  HullPage List(const std::string& prefix, const std::string& after, size_t page_size) const;

  RegistrySizes Sizes() const;
  CacheStatistics Cache() const;
  CommitStatistics Commits() const;
  // Where each batch is timed and counted; set before the first change, and outlives this.
  void SetMetrics(StoreMetrics& metrics) { metrics_ = &metrics; }
  // RESOURCE_EXHAUSTED: --memory-limit, although all that can be dropped was.
  absl::Status CheckMemory();

  // Snapshots of the hulls, all current at one revision of the store. May wait for chunks in
  // progress, read from the store and make snapshots, hence not for gRPC's threads.
  // CANCELLED when should_stop said so.
  absl::StatusOr<Resolved> Resolve(std::span<const std::string> ids,
                                   const std::function<bool()>& should_stop);
  // The same, but nullopt, at once, where it would have to wait or to make what is missing.
  std::optional<Resolved> TryResolve(std::span<const std::string> ids);
  // The same for one hull; NOT_FOUND and DATA_LOSS are the status.
  absl::StatusOr<std::pair<uint64_t, HullView>> Resolve(const std::string& id,
                                                        const std::function<bool()>& should_stop);

  // Opens a session; `done` is called on this or another thread. `on_gone` is called once, on any
  // thread, with the reason when the hull is deleted or replaced before the session is closed.
  // NOT_FOUND; with create_if_absent as Create; DATA_LOSS: the store is damaged;
  // RESOURCE_EXHAUSTED: --max-writers-per-hull.
  void OpenAppend(const std::string& id, const std::string& writer_id, bool create_if_absent,
                  std::function<void(const absl::Status&)> on_gone, Reply<OpenResult> done);

  void CloseAppend(const AppendSession& session);

  // Queues a chunk. `on_built`, which may be empty, is called once its points are no longer held:
  // the next one may be queued then. `done` is called once it is committed or refused. Both come
  // once, on other threads, in either order; what is committed is reported in the order of the
  // sequences, a refusal possibly before what goes before it.
  // Refusals, which change nothing: FAILED_PRECONDITION: a gap in the sequence, or the hull is
  // gone; ABORTED: if_revision does not match; INVALID_ARGUMENT: a point is not finite;
  // RESOURCE_EXHAUSTED: --max-vertices-per-hull, --max-points-per-hull, --max-writers-per-hull,
  // --memory-limit, or the disk is full; UNAVAILABLE: the store cannot be written; DATA_LOSS: the
  // store is damaged; CANCELLED: should_stop said so.
  void Append(const AppendSession& session, Chunk chunk, std::function<bool()> should_stop,
              std::function<void()> on_built, Reply<ChunkResult> done);

 private:
  class Locked;
  struct PendingChunk;
  struct PendingCommit;
  struct OpenRequest;
  friend struct RegisteredHull;
  friend class MemoryCharge;
  using HullPointer = std::shared_ptr<RegisteredHull>;
  // Called with the mutex held once a change is committed or refused.
  using Finish = std::function<void(Locked&, const absl::Status&)>;

  HullPointer Find(const std::string& id) const;
  HullPointer FindVisible(const std::string& id) const;
  HullPointer Insert(const StoredHull& stored);
  void Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason);

  void CreateLocked(Locked& locked, const std::string& id, bool if_absent,
                    const Reply<CreateResult>& done);
  void CreateNew(Locked& locked, const std::string& id,
                 const std::function<void(Locked&, const absl::Status&)>& done);
  void DeleteLocked(Locked& locked, const std::string& id, std::optional<uint64_t> if_revision,
                    const Reply<uint64_t>& done);
  void ReplaceLocked(Locked& locked, const std::shared_ptr<Replacement>& replacement,
                     const Reply<ReplaceResult>& done);
  void CommitReplacement(const HullPointer& former, Replacement& replacement,
                         const Reply<ReplaceResult>& done);
  void FinishReplacement(Locked& locked, const HullPointer& former, const HullPointer& hull,
                         const absl::Status& status, const Reply<ReplaceResult>& done);

  void Submit(const HullPointer& hull, Change change, Finish finish);
  void CommitQueued();
  absl::Status CommitBatch(Locked& locked, const std::vector<PendingCommit>& batch);
  void RefuseQueued(Locked& locked, std::vector<PendingCommit>& batch, const absl::Status& cause);
  void Revert(Locked& locked, RegisteredHull& hull);
  void Advance(Locked& locked, const HullPointer& hull);

  void OpenLocked(Locked& locked, const std::shared_ptr<OpenRequest>& request);
  void OpenSession(Locked& locked, const HullPointer& hull,
                   const std::shared_ptr<OpenRequest>& request, uint64_t last_sequence);
  absl::StatusOr<uint64_t> CommittedSequence(Locked& locked, RegisteredHull& hull,
                                             const std::string& writer_id);
  void RunNextChunk(const HullPointer& hull);
  absl::StatusOr<Change> Build(Locked& locked, const HullPointer& hull, PendingChunk& pending,
                               std::optional<ChunkResult>* already, PointCounts* counts);
  absl::StatusOr<PointCounts> AddPoints(PendingChunk& pending, Change& change,
                                        std::unique_ptr<HullBuilder>& builder);
  absl::Status WhyNotBuilt(RegisteredHull& hull, const absl::Status& cause);
  void FillChange(const RegisteredHull& hull, const PointCounts& added, Change& change);
  absl::Status CheckChunk(Locked& locked, RegisteredHull& hull, const PendingChunk& pending,
                          std::optional<ChunkResult>* already);
  void SubmitChunk(const HullPointer& hull, const PendingChunk& pending, Change change,
                   const PointCounts& counts);

  absl::StatusOr<std::unique_ptr<HullBuilder>> LoadBuilder(
      const StoredHull& stored, const std::function<bool()>& should_stop);
  absl::Status MakeServed(Locked& locked, RegisteredHull& hull,
                          const std::function<bool()>& should_stop);
  void Unpin(Locked& locked, const HullPointer& hull);
  void Charge(Locked& locked, RegisteredHull& hull);
  void Account(RegisteredHull& hull);
  void Evict(Locked& locked);
  bool DropUnused(Locked& locked, RegisteredHull& hull);
  absl::Status CheckMemoryLocked(Locked& locked);

  Store& store_;
  StoreMetrics* metrics_ = nullptr;
  // With the memory limit in force.
  const Limits limits_;
  WorkerPool& writers_;
  const std::shared_ptr<const ServedHull> empty_served_ =
      std::make_shared<const ServedHull>(Hull());

  mutable std::mutex mutex_;
  // The rest, and all of a RegisteredHull but its builder, is guarded by mutex_.
  // The last one that is committed and visible; the last one that a change was given.
  uint64_t revision_ = 0;
  uint64_t assigned_revision_ = 0;
  uint64_t vertex_count_ = 0;
  uint64_t last_watch_ = 0;
  std::map<std::string, HullPointer> hulls_;
  // Those of hulls_ whose creation is not committed yet.
  uint64_t creating_ = 0;

  // Hulls that hold a builder or a snapshot, the last used in front.
  std::list<RegisteredHull*> used_;
  CacheStatistics cache_;

  std::condition_variable commit_ready_;
  std::vector<PendingCommit> queue_;
  CommitStatistics commits_;
  // The last batch failed; the store is to recover before the next.
  bool store_failed_ = false;
  bool ending_ = false;
  std::thread committer_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_REGISTRY_H_
