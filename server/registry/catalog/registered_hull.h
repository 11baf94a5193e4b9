#ifndef HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_
#define HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/synchronization.h"
#include "server/registry/catalog/hull_state.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/memory/served_hull.h"
#include "server/store/records.h"
#include "server/store/store.h"

namespace hulld::server {

struct CompactHull;

// A chunk waiting to be built.
struct PendingChunk {
  AppendSession session;
  Chunk chunk;
  std::function<bool()> should_stop;
  std::function<void()> on_built;
  Reply<ChunkResult> done;
  // Charge for its points.
  MemoryCharge charge;
  // Position among the chunks of the hull.
  uint64_t place = 0;
};

// A builder lent to the thread that builds a chunk.
struct LentBuilder {
  // Null: it must be built from the points at `committed`.
  std::unique_ptr<HullBuilder> builder;
  // Committed points of peer servers that are missing from `builder`.
  std::vector<Vector> backlog;
  LiveHull::Mark committed;
};

// One incarnation of a hull, guarded by the registry's mutex. The thread that owns the builder
// (HullState) uses it without the mutex, and appends to the thread-safe LiveHull while other
// threads prepare it.
//
// Its data forms three groups. *Committed*: the stored state, changed only by SetStored, Commit,
// and Supersede. *In flight*: the state with all changes in flight, and the builder; Revert returns
// it to the committed state. *Served*: the vertices, shared with readers; in memory while needed,
// and otherwise read from the store. Without vertices there is no builder and no change in flight.
class RegisteredHull {
 public:
  // Maximum number of a peer server's points that are added to a hull in memory; takes about 100
  // us. With more, the hull is reloaded at its next use, and its builder is rebuilt.
  static constexpr uint64_t kMaxGrowth = 1 << 12;
  // Maximum number of vertices of a small hull. Its builder uses more memory than the rest of the
  // hull, and is rebuilt in about 20 us.
  static constexpr uint64_t kMaxSmallVertices = 64;
  bool is_small() const { return committed().record.vertex_count <= kMaxSmallVertices; }

  // readable: true if the store can read the hull back.
  RegisteredHull(const StoredHull& stored, const HullState& initial, bool readable,
                 MemoryBudget& budget);

  // ---- Committed ----

  const StoredHull& committed() const { return committed_.stored; }
  // Committed prefix of live().
  const LiveHull::Mark& committed_mark() const { return committed_.mark; }
  // Number of changes by peer servers; detects stale reads from the store.
  uint64_t supersessions() const { return committed_.supersessions; }
  // Describes the committed hull for watches. The bounding box survives eviction of the points.
  HullChange Describe() const;

  // Sets the stored state after the hull's first change. Requires: none was set before.
  void SetStored(const StoredHull& stored);
  // Restores the bounding box of a hull that was at rest.
  void SetBox(const Box& box) { committed_.box = box; }
  // Commits the oldest chunk in flight. mark: the prefix of live() that includes it. points: number
  // of its points that became vertices.
  void Commit(Locked& locked, const Change& chunk, const LiveHull::Mark& mark, uint64_t points);
  // True if a peer server's `stored` is the committed hull plus a few points, all of them in
  // deltas, so that adding them to live() costs less than reloading the hull.
  bool GrewInto(const StoredHull& stored) const;
  // Applies a peer server's `stored` to the committed hull. growth: null, or the added points if
  // GrewInto is true; they are added to live() if it exists. Without growth, changed vertices are
  // dropped from memory. Requires: nothing is in flight. Returns true if the points were added.
  bool Supersede(Locked& locked, const StoredHull& stored, const std::vector<Vector>* growth);
  // Records that a peer server ended the hull. Requires: nothing is in flight.
  void Vanish();

  // ---- In flight ----

  // State including changes in flight. Their revisions are unknown, so it has the committed ones.
  const StoredHull& head() const { return in_flight_.head; }
  // Last sequence of a writer, including chunks in flight; 0 if it is not in memory.
  uint64_t HeadSequence(const std::string& writer_id) const;
  // Last committed sequence of a writer; nullopt if it must be read from the store.
  std::optional<uint64_t> CommittedSequence(const std::string& writer_id) const;
  // Bracket a read of a writer's sequence from the store without the mutex. Commits during the read
  // are newer, so the sequences in memory are kept.
  void StartReadingSequence() { ++in_flight_.sequence_readers; }
  void EndReadingSequence() { --in_flight_.sequence_readers; }
  // Keeps a sequence that was read from the store. Requires: none is in memory.
  void KeepSequence(const std::string& writer_id, uint64_t sequence);
  // Drops the sequences of writers, which the store can restore, if nothing depends on them.
  void DropUnusedWriters();

  // Sets the builder of a hull that is not committed yet.
  void SetBuilder(std::unique_ptr<HullBuilder> builder);
  // Lends the builder to a thread, which may append to live() until it returns the builder. bytes:
  // memory of the returned builder.
  LentBuilder LendBuilder();
  void ReturnBuilder(std::unique_ptr<HullBuilder> builder, uint64_t bytes);
  const HullBuilder* builder() const { return in_flight_.builder.get(); }
  const std::vector<Vector>& builder_backlog() const { return in_flight_.backlog; }
  // Drops the builder unless a thread owns it.
  void DiscardBuilder(Locked& locked);
  // Drops the builder of a small hull that no session appends to, and all data that its changes in
  // flight needed.
  void DiscardUnneededBuilder(Locked& locked);
  // Adds a built chunk to the head, and completes its change. added: counts of its points.
  void AddToHead(const PointCounts& added, const WriterSequence& writer, Change* change);
  // Returns to the committed state after a chunk in flight and all later ones were refused. The
  // first refusal reverts; the later ones have no effect. A thread building on refused chunks drops
  // the builder itself (kReverting).
  void Revert(Locked& locked);

  // ---- Served ----

  // Points of the hull in order of arrival, including those of changes in flight and of the chunk
  // being built; null if they are not in memory.
  const std::shared_ptr<LiveHull>& live() const { return served_.live; }
  // Sets the points of the committed hull. Requires: nothing is in flight.
  void SetLive(std::shared_ptr<LiveHull> points);
  // True if Serve returns a version; false if the points must be read from the store first.
  bool IsReady() const { return committed().record.vertex_count == 0 || live() != nullptr; }
  // Returns the committed version for readers; null if it must be read from the store first. It
  // counts as held for readers until the last of them releases it, even if the hull ends first.
  // Cost: O(log n) for the first reader, O(1) for later ones.
  std::shared_ptr<const ServedHull> Serve();
  // Prefetch the data that IsReady and Serve read: Prefetch this object, PrefetchParts the objects
  // that it refers to. Call the first for several hulls, then the second, so that misses overlap.
  void Prefetch() const;
  void PrefetchParts() const;
  // Approximate bytes that the current version shares with readers, as last counted.
  uint64_t shared_bytes() const { return served_.shared_bytes; }
  // True while a reader reads the points from the store. EndLoading notifies `changed`.
  bool is_loading() const { return served_.is_loading; }
  void StartLoading() { served_.is_loading = true; }
  void EndLoading();
  // True if past and expected queries pay for preparation, and no thread prepares the hull.
  bool WantsPreparing(uint64_t expected_queries) const;
  // True if a thread prepares live(), or is about to.
  bool is_preparing() const { return served_.is_preparing; }
  void SetPreparing(bool prepares) { served_.is_preparing = prepares; }
  // Call when preparation starts; it covers all points committed so far.
  void ResetWear() { served_.points_since_prepared = 0; }
  // Records that live() was prepared; the next reader gets a new version.
  void NotePrepared(Locked& locked);
  // True if most points of live() are no longer vertices. Preparing drops them, which bounds memory
  // while new points replace old vertices and no reader queries the hull. It costs a fraction of
  // appending those points.
  bool IsWorn() const;
  uint64_t points_since_prepared() const { return served_.points_since_prepared; }

  // ---- Memory, sessions, and waiting tasks ----

  // Updates the memory account and the time of last use. Cost: O(log n).
  void NoteUse();
  // Updates the time of last use after a read that changed no memory. Cost: O(1).
  void NoteRead() { account.Touch(); }
  // True if the stored record alone can restore the hull.
  bool IsAtRest() const { return IsUnused() && live() == nullptr && in_flight_.writers.empty(); }
  // Returns the points and sequences that restore the hull together with its record; null unless it
  // is small and unused. Cost: O(points).
  std::unique_ptr<CompactHull> Compact() const;
  // Restores a hull that was compact. Requires: nothing but the box has been set.
  void Restore(const CompactHull& compact);
  // Drops all memory of a hull that is gone.
  void DiscardAll(Locked& locked);
  // Returns a chunk to the queue, before all later chunks.
  void Requeue(PendingChunk chunk);
  // Returns true if a chunk that precedes this one is queued. Requires: this one is not queued.
  bool HasEarlierChunk(const PendingChunk& chunk) const {
    return !chunks.empty() && chunks.front().place < chunk.place;
  }

  HullState state;
  // Notified of each transition of `state`, and when points were read from the store.
  ConditionVariable changed;
  // Callback of each open session.
  std::map<uint64_t, std::function<void(const absl::Status&)>> watches;
  std::list<PendingChunk> chunks;
  uint64_t last_place = 0;
  // Tasks that wait until the hull is quiet; they precede `chunks`.
  std::list<std::function<void(Locked&)>> exclusive;

 private:
  // Last sequences of a writer.
  struct Sequences {
    uint64_t committed = 0;
    // Includes the chunks in flight.
    uint64_t head = 0;
  };
  // A served version while a reader holds it. Its memory counts until it is freed.
  struct PinnedVersion {
    PinnedVersion(std::shared_ptr<const MemoryParts> parts,
                  std::shared_ptr<const ServedHull> served_hull)
        : pin(std::move(parts)), served(std::move(served_hull)) {}
    const MemoryPin pin;
    const std::shared_ptr<const ServedHull> served;
  };

  struct Committed {
    StoredHull stored;
    LiveHull::Mark mark;
    // Empty if unknown.
    Box box = Box::Empty();
    uint64_t supersessions = 0;
  };
  struct InFlight {
    StoredHull head;
    // Revisions of the committed hull while chunks are in flight; each chunk builds on them after
    // its predecessors commit. Written only by the completions of the chunks.
    std::shared_ptr<HullRevisions> revisions;
    // Writers in use; the store has the rest.
    std::unordered_map<std::string, Sequences> writers;
    int sequence_readers = 0;
    // Hull including the changes in flight; null if it must be rebuilt from the points of `live`,
    // or if a thread owns it.
    std::unique_ptr<HullBuilder> builder;
    // Bytes held by the builder, including while a thread owns it.
    uint64_t builder_bytes = 0;
    // Committed points of peer servers that are missing from `builder`; the next chunk adds them
    // first. Empty without `builder`.
    std::vector<Vector> backlog;
    // True if `live` may contain uncommitted points.
    bool live_is_ahead = false;
  };
  struct Served {
    std::shared_ptr<LiveHull> live;
    bool is_loading = false;
    bool is_preparing = false;
    // Points committed since the last preparation, or since `live` was created.
    uint64_t points_since_prepared = 0;
    // Version of `live` at the committed mark; null until the first read after a change.
    std::shared_ptr<const ServedHull> version;
    // Canonical snapshot, shared by all served versions of the committed revision.
    std::shared_ptr<CanonicalHull> canonical;
    // Sum of the account's parts when they were last counted.
    uint64_t shared_bytes = 0;
    // Readers' reference to `version`.
    std::weak_ptr<const PinnedVersion> readers;
  };

  void SetCommittedMark(Locked& locked, const LiveHull::Mark& mark);
  // Drop the served version, and the canonical snapshot; the next reader rebuilds them.
  void DiscardServed(Locked& locked);
  void DiscardCanonical(Locked& locked);
  // Drops the points beyond the committed mark after their refusal.
  void RevertLive(Locked& locked);
  void Grow(Locked& locked, const std::vector<Vector>& points, int dimension);
  // True if no call, thread, or session depends on more than the record and the points.
  bool IsUnused() const;
  bool IsRead() const { return !served_.readers.expired() || live().use_count() > 1; }
  // Updates the account's shared parts.
  void CountParts();
  // Drops unused memory that can be rebuilt.
  void DropUnused(Locked& locked);

  const bool readable_from_store_;
  Committed committed_;
  InFlight in_flight_;
  Served served_;

 public:
  // Last member, so that it closes before anything that it counts is destroyed.
  MemoryBudget::Account account;
};

// Shared served version of a hull without vertices; not counted.
const std::shared_ptr<const ServedHull>& EmptyServedHull();

// Calls `done` after the mutex is released.
template <typename T>
void Answer(Locked& locked, const Reply<T>& done, std::type_identity_t<absl::StatusOr<T>> result) {
  locked.Defer([done, result = std::move(result)] { done(result); });
}

// FAILED_PRECONDITION: the hull of a session ended. how: for example, "deleted".
absl::Status Gone(const std::string& id, const char* how);
// UNAVAILABLE: a shared store lacks an expected record, and no peer server removed it.
absl::Status StoreDisagrees(const HullRecord& record);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_
