#ifndef HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_
#define HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/hull/growth/hull_builder.h"
#include "core/query/placed/live_hull.h"
#include "server/process/synchronization.h"
#include "server/registry/catalog/hull_state.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/registry/memory/served_hull.h"
#include "server/store/hull_record.h"

namespace hulld::server {

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

// One incarnation of a hull, guarded by the registry's mutex. The thread that HullState makes its
// owner uses the builder without the mutex, and appends to the thread-safe LiveHull while other
// threads prepare it.
//
// The vertices are in `live` while needed, and are otherwise read from the store. Without `live`,
// there is no builder and no change in flight.
struct RegisteredHull {
  // Last sequences of a writer.
  struct Sequences {
    uint64_t committed = 0;
    // Includes the chunks in flight.
    uint64_t head = 0;
  };

  // Maximum number of a peer server's points that are added to a hull in memory: some 100 us. With
  // more, the hull is reloaded at its next use, and its builder is rebuilt.
  static constexpr uint64_t kMostGrowth = 1 << 12;

  // readable: true if the store can read the hull back.
  RegisteredHull(const StoredHull& stored, const HullState& initial, bool readable,
                 MemoryBudget& budget);

  // Sets the stored state after the hull's first change. Requires: none was set before.
  void SetStored(const StoredHull& stored) {
    HULLD_CHECK(committed.record.revision == 0);
    committed = head = stored;
  }
  // True if most points of `live` are no longer vertices. Preparing drops them, which bounds memory
  // when points swallow each other and no reader asks. It costs a fraction of appending those
  // points.
  bool HoldsMuchElse() const;
  // Updates the memory account and the time of last use. Cost: O(log n).
  void NoteUse();
  // Drops the builder unless a thread owns it.
  void DiscardBuilder(Locked& locked);
  // Sets the points of the committed hull. Requires: nothing is in flight.
  void SetLive(std::shared_ptr<LiveHull> points);
  // Marks `live` as committed up to `mark`.
  void SetCommittedMark(Locked& locked, const LiveHull::Mark& mark);
  // True if Serve returns a version; false if the points must be read from the store first.
  bool IsReady() const { return committed.record.vertex_count == 0 || live != nullptr; }
  // Returns the committed version for readers; null if it must be read from the store first. It
  // counts as held for readers until the last of them releases it, even if the hull ends first.
  // Cost: O(log n) for the first reader, O(1) for later ones.
  std::shared_ptr<const ServedHull> Serve();
  // True if a reader holds a reference.
  bool IsRead() const { return !read_.expired() || live.use_count() > 1; }
  // Approximate bytes that the current version shares with readers.
  uint64_t SharedBytes() const;
  // Drops the served version; the next reader rebuilds it. Keeps the canonical snapshot.
  void DiscardServed(Locked& locked);
  // Drops the points beyond the committed mark after their refusal.
  void RevertLive(Locked& locked);
  // Returns a chunk to the queue, before all later chunks.
  void Requeue(PendingChunk chunk);
  // True if an earlier chunk than this one, which is not queued, is queued.
  bool IsQueuedBefore(const PendingChunk& chunk) const {
    return !chunks.empty() && chunks.front().place < chunk.place;
  }
  // Drops all memory of a hull that is gone.
  void DiscardAll(Locked& locked);
  // True if a peer server's `stored` is the committed hull plus a few points, all of them in
  // deltas, so that adding them to `live` costs less than reloading the hull.
  bool GrewInto(const StoredHull& stored) const;
  // Applies a peer server's `stored` to the committed hull. growth: null, or the added points if
  // GrewInto is true; they are added to `live` if it exists. Without growth, changed vertices are
  // dropped from memory. Requires: nothing is in flight. Returns true if the points were added.
  bool Supersede(Locked& locked, const StoredHull& stored, const std::vector<Vector>* growth);
  // Describes the committed hull for watches.
  HullChange Describe() const;
  // Returns the last sequence of a writer, including chunks in flight; 0 if it is not in `writers`.
  uint64_t HeadSequence(const std::string& writer_id) const;

  HullState state;
  const bool readable_from_store;
  StoredHull committed;
  // State including changes in flight. Their revisions are unknown, so it has those of `committed`.
  StoredHull head;
  // Revisions of `committed` while chunks are in flight; each chunk builds on them after its
  // predecessors commit. Written only by the completions of the chunks.
  std::shared_ptr<HullRevisions> revisions;
  // Points of the hull in order of arrival, including those of changes in flight and of the chunk
  // being built.
  std::shared_ptr<LiveHull> live;
  // Committed prefix of `live`.
  LiveHull::Mark committed_mark;
  // Bounding box of the committed hull; survives eviction of `live`.
  bool has_box = false;
  Vector low;
  Vector high;
  // `live` may hold uncommitted points.
  bool live_is_ahead = false;
  // A reader is reading the points from the store.
  bool loading = false;
  // A thread prepares `live`, or is about to.
  bool preparing = false;
  // Points committed since the last preparation, or since `live` was made.
  uint64_t points_since_prepared = 0;
  // Version of `live` at committed_mark; null until the first read after a change.
  std::shared_ptr<const ServedHull> served;
  // Canonical snapshot, shared by all served versions of committed.record.revision.
  std::shared_ptr<CanonicalHull> canonical;
  // Writers in use; the store holds the rest.
  std::unordered_map<std::string, Sequences> writers;
  // Number of threads reading a writer's sequence from the store without the mutex. Commits during
  // the read are newer, so `writers` keeps them.
  int sequence_readers = 0;
  // Number of changes by peer servers; detects stale reads from the store.
  uint64_t supersessions = 0;
  // One per open session.
  std::map<uint64_t, std::function<void(const absl::Status&)>> watches;

  // Hull including the changes in flight; null if it must be rebuilt from the points of `live`, or
  // if a thread owns it.
  std::unique_ptr<HullBuilder> builder;
  // Bytes held by the builder, including while a thread owns it.
  uint64_t builder_bytes = 0;
  // Committed points of peer servers that are missing from `builder`; the next chunk adds them
  // first. Empty without `builder`.
  std::vector<Vector> builder_lacks;
  // Notified of each transition of `state`, and when points were read from the store.
  ConditionVariable changed;
  std::list<PendingChunk> chunks;
  uint64_t last_place = 0;
  // Tasks that wait until the hull is quiet; they precede `chunks`.
  std::list<std::function<void(Locked&)>> exclusive;

  // Last member, so that it closes before anything that it counts is destroyed.
  MemoryBudget::Account account;

 private:
  // A served version while a reader holds it. Its memory counts until it is freed.
  struct Reading {
    Reading(std::vector<std::shared_ptr<MemoryPart>> parts,
            std::shared_ptr<const ServedHull> served_hull)
        : pin(std::move(parts)), served(std::move(served_hull)) {}
    const MemoryPin pin;
    const std::shared_ptr<const ServedHull> served;
  };

  void KeepBox();
  void Grow(Locked& locked, const std::vector<Vector>& points, int dimension);
  // Updates the account's shared parts.
  void CountParts();
  // Drops unused memory that can be rebuilt.
  void DropUnused(Locked& locked);

  // Readers' reference to `served`.
  std::weak_ptr<const Reading> read_;
};

// Shared served version of a hull without vertices; not counted.
const std::shared_ptr<const ServedHull>& EmptyServedHull();

// Calls `done` after the mutex is released.
template <typename T>
void Answer(Locked& locked, const Reply<T>& done, absl::StatusOr<T> result) {
  locked.Afterwards([done, result = std::move(result)] { done(result); });
}

std::string QuotedHull(const std::string& id);
// FAILED_PRECONDITION: the hull of a session ended. how: "deleted".
absl::Status Gone(const std::string& id, const char* how);
absl::Status HullNotFound(const std::string& id);

// UNAVAILABLE: a shared store lacks an expected record, and no peer server removed it.
absl::Status StoreDisagrees(const HullRecord& record);
absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_
