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

// A client of the feed. Guarded by the feed's mutex.
struct ChangeWatch : std::enable_shared_from_this<ChangeWatch> {
  enum class Stage {
    // A resumed watch: reports deletions since its revision.
    kDeletions,
    // Lists existing hulls in the order of IDs.
    kPresent,
    // Reports changes.
    kChanges,
  };

  std::shared_ptr<WatchInterest> interest;
  // Called on the feed's thread without locks.
  std::function<void()> on_ready;

  Stage stage = Stage::kChanges;
  // Existing hulls are listed if they changed after this revision.
  uint64_t after_revision = 0;
  // Revision of the last reported deletion, and ID of the last listed hull.
  uint64_t last_deletion = 0;
  std::string last_id;
  // If the store finds records: the next page of the list, or the error of its read; true while a
  // read is in flight; and the number of reads started.
  std::optional<absl::StatusOr<FoundRecords>> found;
  bool is_reading = false;
  uint64_t readings = 0;
  // In kChanges: every change up to this revision was reported.
  uint64_t cursor = 0;
  // The cursor at the last report.
  uint64_t told = 0;
  // In kChanges: `synced` is due when the cursor reaches this revision; no value after it was sent.
  std::optional<uint64_t> synced_at;
  // The reported state is that of the store at the cursor, so creations can be recognized.
  bool is_exact = false;
  bool anew = false;
  // on_ready is due at the next change.
  bool is_armed = false;
  // The next piece does not wait, even if it is empty.
  bool is_nudged = false;
};

// Notifies watches of changes of hulls and bodies. Guarded by the registry's mutex, which a
// `Locked` proves to be held; the feed's thread also takes it. An ID belongs to a hull or to a
// body; a watch of hulls alone does not see an ID while a body has it.
//
// Watches of the same target share an interest, which keeps the last change of each hull in the
// order of revisions; a watch is a cursor in it. A change thus costs O(log n) per target that
// includes the hull, however many watches it has; a slow watch costs the number of changed hulls,
// not of changes. An interest drops its changes when all of its watches have passed them. Targets
// are found by the ID and by each watched length of a prefix.
//
// A watch without pending changes is armed. The first change afterwards makes its interest due, in
// O(1); the feed's thread then calls on_ready of all armed watches without the mutex. Each takes
// its next piece when it can send one, and is armed again if nothing is pending.
//
// A deletion leaves no trace in the store. The feed remembers a bounded number of deletions for
// watches that resume and, per interest, for watches that are behind. A watch that needs older ones
// starts over.
class ChangeFeed {
 public:
  // Maximum number of remembered deletions; at most 25 MiB with IDs of maximum length, which no
  // budget counts.
  static constexpr size_t kMostDeletions = 1 << 16;
  // Maximum number of hulls visited or reported per hold of the mutex: some 50 us.
  static constexpr size_t kMostPerPiece = 512;

  // Pending changes are charged to the budget. mark_interval: the interval at which a watch without
  // changes learns the current revision.
  ChangeFeed(FairMutex& order, MemoryBudget& budget, std::chrono::milliseconds mark_interval);
  ChangeFeed(const ChangeFeed&) = delete;
  ChangeFeed& operator=(const ChangeFeed&) = delete;
  // Requires that all watches are closed.
  ~ChangeFeed();

  // Begins at the revision of the loaded store, without history. Call before all other functions.
  void Begin(uint64_t revision);

  // Note a committed change at the revision of its record; a deletion at `revision`. Cost: O(log n)
  // per target that includes the ID, and one hash per watched length of a prefix.
  void NoteCreated(Locked& locked, const std::shared_ptr<RegisteredHull>& hull);
  void NoteChanged(Locked& locked, const std::shared_ptr<RegisteredHull>& hull);
  void NoteReplaced(Locked& locked, const std::shared_ptr<RegisteredHull>& hull);
  void NoteDeleted(Locked& locked, const HullRecord& record, uint64_t revision);
  // Note a change of a body. former: the body that it replaces, or null.
  void NoteBodyPut(Locked& locked, const BodyRecord* former,
                   const std::shared_ptr<const Body>& body);
  void NoteBodyDeleted(Locked& locked, const BodyRecord& record, uint64_t revision);
  // Note that peer servers turned a hull into a body, or a body into a hull, by several changes;
  // reported as a single change.
  void NoteBecameBody(Locked& locked, const HullRecord& former,
                      const std::shared_ptr<const Body>& body);
  void NoteBecameHull(Locked& locked, const BodyRecord& former,
                      const std::shared_ptr<RegisteredHull>& hull);
  // Notes a revision whose change cannot be described; waiting watches learn the revision only.
  void NoteOther(const Locked& locked, uint64_t revision);

  // Opens a watch in kChanges, for changes committed later.
  std::shared_ptr<ChangeWatch> Open(const WatchTarget& target, std::function<void()> on_ready);
  // Closes a watch. An on_ready that is already due is still called.
  void Close(const std::shared_ptr<ChangeWatch>& watch);

  // Adds and removes watched IDs; later changes count. Requires a target that varies; `dropped`
  // must have been added before. Cost: one hash per ID.
  void WatchAlso(ChangeWatch& watch, std::span<const std::string> added,
                 std::span<const std::string> dropped);

  static const WatchTarget& TargetOf(const ChangeWatch& watch);
  // True if all deletions after this revision are remembered.
  bool Remembers(uint64_t revision) const { return revision >= deletions_begin_; }
  // Moves a watch back to the start of the list; its next piece says so.
  void StartAnew(ChangeWatch& watch);
  // Adds deletions after watch.last_deletion, up to the cursor. Returns false after the last.
  bool TakeDeletions(ChangeWatch& watch, const std::function<bool(const std::string&)>& is_there,
                     WatchPiece* piece);
  // Skips all pending changes.
  void SkipChanges(ChangeWatch& watch) { MoveCursor(watch, revision_); }
  // Adds changes after the cursor. Arms the watch if it has none.
  void TakeChanges(ChangeWatch& watch, WatchPiece* piece);
  // True if changes after the cursor were dropped, so that the watch must start over.
  bool IsLost(const ChangeWatch& watch) const;

  // Makes the watch wait for a wake-up or a change.
  void Arm(ChangeWatch& watch);
  // Calls on_ready of a waiting watch.
  void Wake(Locked& locked, const std::shared_ptr<ChangeWatch>& watch);
  // True if a remembered deleted ID was created again as a hull or, if `bodies`, as a body.
  bool BeganAnew(const std::string& id, bool bodies) const {
    const auto found = gone_.find(id);
    return found == gone_.end() || (bodies && found->second.is_body_now);
  }

  // Calls on_ready of a watch although nothing changed.
  void Nudge(Locked& locked, const std::shared_ptr<ChangeWatch>& watch);
  // Nudges all watches; later pieces are empty.
  void End(Locked& locked);
  bool has_ended() const { return has_ended_; }

 private:
  struct Hash {
    using is_transparent = void;
    size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
  };
  using Interests = std::vector<std::shared_ptr<WatchInterest>>;
  enum class Life { kBegan, kChanged, kReplaced, kEnded };
  // The committed state of an ID.
  struct State {
    // Revision of the change.
    uint64_t revision;
    // Start of the current incarnation, or of the deleted one.
    uint64_t create_revision;
    Life life;
    bool is_body = false;
    // At most one is set; both are null for a deletion.
    std::shared_ptr<RegisteredHull> hull = nullptr;
    std::shared_ptr<const Body> body = nullptr;
    // If the change replaced a hull by a body or a body by a hull: create_revision of the former.
    // Otherwise 0.
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
  // The feed's thread.
  void Run();
  void NudgeForMarks();

  FairMutex& order_;
  const std::chrono::milliseconds mark_interval_;

  // The members below are guarded by order_.
  uint64_t revision_ = 0;
  // By revision. Deletions up to deletions_begin_ are not remembered.
  std::deque<Deletion> deletions_;
  uint64_t deletions_begin_ = 0;
  // The last deletion of each ID that no hull has used since: its revision, and true if a body has
  // used the ID since. The key refers to the ID in `deletions_`.
  struct Gone {
    uint64_t revision;
    bool is_body_now = false;
  };
  std::unordered_map<std::string_view, Gone> gone_;

  // Interests by prefix, and by ID.
  std::unordered_map<std::string, Interests, Hash, std::equal_to<>> by_prefix_;
  // Number of interests by length of their prefix.
  std::map<size_t, size_t> prefix_lengths_;
  std::unordered_map<std::string, Interests, Hash, std::equal_to<>> by_id_;
  std::set<std::shared_ptr<ChangeWatch>> watches_;

  // Bytes of all pending changes.
  uint64_t bytes_ = 0;
  MemoryCharge charge_;

  // Input of the thread.
  ConditionVariable wake_;
  Interests due_;
  std::vector<std::shared_ptr<ChangeWatch>> ready_;
  bool has_ended_ = false;
  bool ending_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_CATALOG_CHANGE_FEED_H_
