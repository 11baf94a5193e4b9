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

// A chunk that waits to be built.
struct PendingChunk {
  AppendSession session;
  Chunk chunk;
  std::function<bool()> should_stop;
  std::function<void()> on_built;
  Reply<ChunkResult> done;
  // Counts its points.
  MemoryCharge charge;
  // Its place among the chunks of the hull.
  uint64_t place = 0;
};

// One incarnation of a hull, guarded by the registry's mutex. The builder is used without it, by
// the thread that HullState makes its owner; so is the LiveHull, which is thread-safe: that same
// thread appends to it, while others prepare it.
//
// The hull's vertices are in `live` while anyone needs them, and can be read from the store
// otherwise. Without `live` there is no builder and no change in flight.
struct RegisteredHull {
  // The last sequence of a writer.
  struct Sequences {
    uint64_t committed = 0;
    // With the chunks in flight.
    uint64_t head = 0;
  };

  // Points that other servers added and that are added here at once, at most: some 100 us. With
  // more, the hull is read anew when it is next asked for; so is a builder made anew.
  static constexpr uint64_t kMostGrowth = 1 << 12;

  // readable: whether the store gives back what it keeps of the hull.
  RegisteredHull(const StoredHull& stored, const HullState& initial, bool readable,
                 MemoryBudget& budget);

  // What the store keeps of it, as of its first change. Requires that nothing else was kept before.
  void SetStored(const StoredHull& stored) {
    HULLD_CHECK(committed.record.revision == 0);
    committed = head = stored;
  }
  // Whether most points of `live` are no vertices any more: preparing drops them, and keeps memory
  // bounded where points take each other in and nobody asks. It costs a part of what appending
  // those points did.
  bool HoldsMuchElse() const;
  // Counts what the hull holds now, and that it was used just now. Cost: O(log n).
  void NoteUse();
  // Drops the builder, unless a thread owns it.
  void DiscardBuilder(Locked& locked);
  // The committed hull has these points from now on. Requires that nothing is in flight.
  void SetLive(std::shared_ptr<LiveHull> points);
  // Up to there `live` is committed.
  void SetCommittedMark(Locked& locked, const LiveHull::Mark& mark);
  // Whether Serve gives something: not when the points are to be read from the store first.
  bool IsReady() const { return committed.record.vertex_count == 0 || live != nullptr; }
  // What readers are given of the committed hull; null when that is to be read from the store
  // first. It counts as held for readers until the last of them lets go of it, whatever becomes of
  // the hull. Cost: O(log n) for the first of them, O(1) for others.
  std::shared_ptr<const ServedHull> Serve();
  // Whether a reader holds it.
  bool IsRead() const { return !read_.expired() || live.use_count() > 1; }
  // About what its current version shares with readers, in bytes.
  uint64_t SharedBytes() const;
  // What is served is made anew when the next reader asks; the canonical snapshot stays.
  void DiscardServed(Locked& locked);
  // The points beyond what is committed were refused.
  void RevertLive(Locked& locked);
  // A chunk waits again, before those that came after it.
  void Requeue(PendingChunk chunk);
  // Whether a chunk waits that came before this one, which does not.
  bool IsQueuedBefore(const PendingChunk& chunk) const {
    return !chunks.empty() && chunks.front().place < chunk.place;
  }
  // The hull is gone.
  void DiscardAll(Locked& locked);
  // Whether `stored`, of another server, is the committed hull with few points more, all of them in
  // deltas, so that adding those to `live` costs less than reading the hull anew.
  bool GrewInto(const StoredHull& stored) const;
  // Another server made `stored` of the committed hull. growth: null, or what GrewInto says is all
  // that came, which is added where there is `live`; without it what is in memory goes where
  // vertices changed. Requires that nothing is in flight. Returns whether it was added.
  bool Supersede(Locked& locked, const StoredHull& stored, const std::vector<Vector>* growth);
  // The committed hull, as watches are told of it.
  HullChange Describe() const;
  // The last sequence of a writer, chunks in flight included; 0 for a writer not in `writers`.
  uint64_t HeadSequence(const std::string& writer_id) const;

  HullState state;
  const bool readable_from_store;
  StoredHull committed;
  // With the changes in flight, whose revisions are not known: those in it are of `committed`.
  StoredHull head;
  // Those of `committed`, while chunks are in flight: what each of them builds on once those before
  // it are committed. Written by their completions alone.
  std::shared_ptr<HullRevisions> revisions;
  // The points of the hull in the order in which they came, with those of the changes in flight and
  // of the chunk that is being built.
  std::shared_ptr<LiveHull> live;
  // The moment of `live` that is committed.
  LiveHull::Mark committed_mark;
  // The bounding box of the committed hull; stays when `live` goes.
  bool has_box = false;
  Vector low;
  Vector high;
  // `live` may hold more than that.
  bool live_is_ahead = false;
  // A reader reads the points from the store.
  bool loading = false;
  // A thread prepares `live`, or is about to.
  bool preparing = false;
  // What was committed since that was done last, or since `live` was made.
  uint64_t points_since_prepared = 0;
  // The version of `live` at committed_mark; null until the first reader after a change asks.
  std::shared_ptr<const ServedHull> served;
  // Its snapshot, shared by all that is served of committed.record.revision.
  std::shared_ptr<CanonicalHull> canonical;
  // Those in use; the store has the others.
  std::unordered_map<std::string, Sequences> writers;
  // Threads that read a writer's sequence from the store, without the mutex. What is committed
  // meanwhile is newer than what they read, so `writers` keeps it for them.
  int sequence_readers = 0;
  // How often another server changed the hull: what was read before is not the last any more.
  uint64_t supersessions = 0;
  // One per open session.
  std::map<uint64_t, std::function<void(const absl::Status&)>> watches;

  // The hull with the changes in flight; null when it is to be made of the points of `live`, or
  // when a thread owns it.
  std::unique_ptr<HullBuilder> builder;
  // What it holds, also while a thread owns it.
  uint64_t builder_bytes = 0;
  // Points of the committed hull that other servers added and that `builder` lacks; the next chunk
  // to be built adds them. None without `builder`.
  std::vector<Vector> builder_lacks;
  // Told of each step of `state`, and when points were read from the store.
  ConditionVariable changed;
  std::list<PendingChunk> chunks;
  uint64_t last_place = 0;
  // What waits until the hull is quiet; goes before chunks.
  std::list<std::function<void(Locked&)>> exclusive;

  // Last, so that it is closed before anything that it counts ends.
  MemoryBudget::Account account;

 private:
  // What is served, as long as a reader holds it. The memory counts until it is free.
  struct Reading {
    Reading(std::vector<std::shared_ptr<MemoryPart>> parts,
            std::shared_ptr<const ServedHull> served_hull)
        : pin(std::move(parts)), served(std::move(served_hull)) {}
    const MemoryPin pin;
    const std::shared_ptr<const ServedHull> served;
  };

  void KeepBox();
  void Grow(Locked& locked, const std::vector<Vector>& points, int dimension);
  // Brings what the account says of parts up to date.
  void CountParts();
  // Drops what is not in use, if it can be made again.
  void DropUnused(Locked& locked);

  // What readers hold of `served`.
  std::weak_ptr<const Reading> read_;
};

// What is served of a hull without vertices; one for all, and not counted.
const std::shared_ptr<const ServedHull>& EmptyServedHull();

// Answers once the mutex is not held.
template <typename T>
void Answer(Locked& locked, const Reply<T>& done, absl::StatusOr<T> result) {
  locked.Afterwards([done, result = std::move(result)] { done(result); });
}

std::string QuotedHull(const std::string& id);
// FAILED_PRECONDITION: the hull of a session ended. how: "deleted".
absl::Status Gone(const std::string& id, const char* how);
absl::Status HullNotFound(const std::string& id);

// UNAVAILABLE: a store that is shared lacks what it should hold, and no other server took it.
absl::Status StoreDisagrees(const HullRecord& record);
absl::Status RevisionMismatch(const HullRecord& record, uint64_t if_revision);

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_REGISTERED_HULL_H_
