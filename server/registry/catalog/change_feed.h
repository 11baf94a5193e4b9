#ifndef HULLD_SERVER_REGISTRY_CATALOG_CHANGE_FEED_H_
#define HULLD_SERVER_REGISTRY_CATALOG_CHANGE_FEED_H_

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/hull_record.h"
#include "server/store/store.h"

namespace hulld::server {

struct WatchInterest;

// A client of the feed that wants to be told of changes. Guarded by the mutex of the feed.
struct ChangeWatch : std::enable_shared_from_this<ChangeWatch> {
  enum class Stage {
    // Resumes: is told what went since.
    kDeletions,
    // Is told what is there, in the order of IDs.
    kPresent,
    // Is told what changes.
    kChanges,
  };

  std::shared_ptr<WatchInterest> interest;
  // Called on the feed's thread, without any lock.
  std::function<void()> on_ready;

  Stage stage = Stage::kChanges;
  // What is there is told where it changed after this revision.
  uint64_t after_revision = 0;
  // The last deletion that was told, by its revision; the last hull that was told, by its ID.
  uint64_t last_deletion = 0;
  std::string last_id;
  // Where a store finds records: those that are told next, or why they could not be read, while
  // they are there; whether they are being read; and how often that was begun.
  std::optional<absl::StatusOr<FoundRecords>> found;
  bool is_reading = false;
  uint64_t readings = 0;
  // Every change up to this one was told, once the stages before kChanges are over.
  uint64_t cursor = 0;
  // The cursor when something was told last.
  uint64_t told = 0;
  // kChanges: `synced` is due once the cursor is there; none when it was told.
  std::optional<uint64_t> synced_at;
  // What was told is the state of the store at the cursor, so that it is known what is new.
  bool is_exact = false;
  bool anew = false;
  // on_ready is due when something changes.
  bool is_armed = false;
  // The next piece does not wait, whatever there is to tell.
  bool is_nudged = false;
};

// Tells watches which hulls, and which bodies, changed. Guarded by its owner's mutex (the
// registry's), which `Locked` shows; its thread takes that mutex, too. An ID is that of a hull or
// of a body; watches of hulls alone are not told of what the ID is while it is a body's.
//
// What changed is kept once for all watches of the same target, their interest: each hull at its
// last change only, in the order of revisions. A watch is a cursor in that order. So a change costs
// O(log n) for each target that the hull falls under, however many watch it; a slow watch costs
// what its cursor is behind by in hulls, not in changes; and what all watches of an interest were
// told is dropped. Targets are found by the ID, and by each length of a prefix that is watched.
//
// A watch that was told everything is armed. The first change after that makes its interest due:
// O(1) under the mutex. The feed's thread then calls on_ready of all that were armed, without the
// mutex; each comes for its next piece whenever it can send one, and is armed again when there is
// none.
//
// What went leaves no trace in the store. A bounded number of deletions is remembered, for watches
// that resume and, within an interest, for those that are behind. One that needs to know of more
// starts anew.
class ChangeFeed {
 public:
  // How many deletions are remembered; with IDs of the greatest length, 25 MiB, which no budget
  // counts.
  static constexpr size_t kMostDeletions = 1 << 16;
  // Hulls that are looked at, or told of, at a time: some 50 us under the mutex.
  static constexpr size_t kMostPerPiece = 512;

  // What watches were not told yet counts against the budget. mark_interval: how often a watch is
  // told that the revision moved on.
  ChangeFeed(FairMutex& order, MemoryBudget& budget, std::chrono::milliseconds mark_interval);
  ChangeFeed(const ChangeFeed&) = delete;
  ChangeFeed& operator=(const ChangeFeed&) = delete;
  // Requires that all watches are closed.
  ~ChangeFeed();

  // What the store holds is of this revision, and nothing is known of what went before; first of
  // all.
  void Begin(uint64_t revision);

  // A change was committed. It was given the record's revision; of a deletion, `revision`.
  // Cost: O(log n) for each target that the ID falls under, and a hash of the ID for each length of
  // a watched prefix.
  void NoteCreated(Locked& locked, const std::shared_ptr<RegisteredHull>& hull);
  void NoteChanged(Locked& locked, const std::shared_ptr<RegisteredHull>& hull);
  void NoteReplaced(Locked& locked, const std::shared_ptr<RegisteredHull>& hull);
  void NoteDeleted(Locked& locked, const HullRecord& record, uint64_t revision);
  // The same of a body. former: that of which it takes the place; null for none.
  void NoteBodyPut(Locked& locked, const BodyRecord* former,
                   const std::shared_ptr<const Body>& body);
  void NoteBodyDeleted(Locked& locked, const BodyRecord& record, uint64_t revision);
  // Other servers made one of the other, by more than one change; told as one.
  void NoteBecameBody(Locked& locked, const HullRecord& former,
                      const std::shared_ptr<const Body>& body);
  void NoteBecameHull(Locked& locked, const BodyRecord& former,
                      const std::shared_ptr<RegisteredHull>& hull);
  // What cannot be told was given this revision: watches that wait are told that it moved on.
  void NoteOther(const Locked& locked, uint64_t revision);

  // Starts at the stage kChanges, with what is committed from now on.
  std::shared_ptr<ChangeWatch> Open(const WatchTarget& target, std::function<void()> on_ready);
  // Nothing is to be told any more. An on_ready that is due by then still comes.
  void Close(const std::shared_ptr<ChangeWatch>& watch);

  // What changes of `added` from now on is told, too, and what changes of `dropped` no more.
  // Requires a target that varies; what is dropped was added, once. Cost: a hash for each ID.
  void WatchAlso(ChangeWatch& watch, std::span<const std::string> added,
                 std::span<const std::string> dropped);

  static const WatchTarget& TargetOf(const ChangeWatch& watch);
  // Whether all that went after this revision is remembered.
  bool Remembers(uint64_t revision) const { return revision >= deletions_begin_; }
  // Moves a watch back to where everything is told, and says so.
  void StartAnew(ChangeWatch& watch);
  // Some of what went after watch.last_deletion and up to the cursor. Returns false after the last.
  bool TakeDeletions(ChangeWatch& watch, const std::function<bool(const std::string&)>& is_there,
                     WatchPiece* piece);
  // The watch is to be told of nothing that changed until now.
  void SkipChanges(ChangeWatch& watch) { MoveCursor(watch, revision_); }
  // Some of what changed after the cursor. Arms the watch where there is nothing to tell.
  void TakeChanges(ChangeWatch& watch, WatchPiece* piece);
  // Whether what changed after the cursor is known no more, so that the watch must start anew.
  bool IsLost(const ChangeWatch& watch) const;

  // The watch waits until it is woken, or something changes.
  void Arm(ChangeWatch& watch);
  // A watch that waits comes for its next piece.
  void Wake(Locked& locked, const std::shared_ptr<ChangeWatch>& watch);
  // Whether an ID that is among the deletions that are remembered began anew since, as a hull, or
  // as a body where these count.
  bool BeganAnew(const std::string& id, bool bodies) const {
    const auto found = gone_.find(id);
    return found == gone_.end() || (bodies && found->second.is_body_now);
  }

  // Has a watch come for its next piece although nothing changed.
  void Nudge(Locked& locked, const std::shared_ptr<ChangeWatch>& watch);
  // Nudges all; there is nothing to tell from now on.
  void End(Locked& locked);
  bool has_ended() const { return has_ended_; }

 private:
  struct Hash {
    using is_transparent = void;
    size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
  };
  using Interests = std::vector<std::shared_ptr<WatchInterest>>;
  enum class Life { kBegan, kChanged, kReplaced, kEnded };
  // What is committed now of an ID.
  struct State {
    // The revision of the change.
    uint64_t revision;
    // When the incarnation began that is there, or that went.
    uint64_t create_revision;
    Life life;
    bool is_body = false;
    // One of them, or none when it went.
    std::shared_ptr<RegisteredHull> hull = nullptr;
    std::shared_ptr<const Body> body = nullptr;
    // Not 0: what the ID was before was of the other kind and ended by the same change; this is the
    // create_revision of that.
    uint64_t other_kind_began = 0;
  };
  struct Deletion {
    uint64_t revision;
    std::string id;
    bool is_body;
  };

  void Note(Locked& locked, const std::string& id, const State& state);
  static std::optional<State> AsToldTo(const WatchTarget& target, const State& state);
  void NoteFor(Locked& locked, const std::shared_ptr<WatchInterest>& interest,
               const std::string& id, const State& state);
  void NoteBegan(const std::string& id, bool is_body);
  void RememberDeletion(const std::string& id, const State& state);
  std::shared_ptr<WatchInterest> FindInterest(const WatchTarget& target) const;
  void AddInterest(const std::shared_ptr<WatchInterest>& interest);
  void RemoveInterest(const std::shared_ptr<WatchInterest>& interest);
  void AddId(const std::string& id, const std::shared_ptr<WatchInterest>& interest);
  void RemoveId(const std::string& id, const std::shared_ptr<WatchInterest>& interest);
  void MoveCursor(ChangeWatch& watch, uint64_t revision);
  void Forget(WatchInterest& interest);
  void Count(uint64_t before, uint64_t now);
  void MakeReady(const std::shared_ptr<ChangeWatch>& watch);
  // The thread.
  void Run();
  void NudgeForMarks();

  FairMutex& order_;
  const std::chrono::milliseconds mark_interval_;

  // The rest is guarded by order_.
  uint64_t revision_ = 0;
  // In the order of revisions. What went up to deletions_begin_ is not remembered.
  std::deque<Deletion> deletions_;
  uint64_t deletions_begin_ = 0;
  // The last of these for each ID, where no hull began under the ID since: its revision, and
  // whether a body did; by the ID in `deletions_`.
  struct Gone {
    uint64_t revision;
    bool is_body_now = false;
  };
  std::unordered_map<std::string_view, Gone> gone_;

  // By a prefix, and by an ID: the interests in it.
  std::unordered_map<std::string, Interests, Hash, std::equal_to<>> by_prefix_;
  // How many interests in prefixes are of each length.
  std::map<size_t, size_t> prefix_lengths_;
  std::unordered_map<std::string, Interests, Hash, std::equal_to<>> by_id_;
  std::set<std::shared_ptr<ChangeWatch>> watches_;

  // What is kept for watches that are behind.
  uint64_t bytes_ = 0;
  MemoryCharge charge_;

  // For the thread.
  ConditionVariable wake_;
  Interests due_;
  std::vector<std::shared_ptr<ChangeWatch>> ready_;
  bool has_ended_ = false;
  bool ending_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_CHANGE_FEED_H_
