#ifndef HULLD_SERVER_REGISTRY_WATCH_CHANGE_FEED_H_
#define HULLD_SERVER_REGISTRY_WATCH_CHANGE_FEED_H_

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "server/process/synchronization.h"
#include "server/registry/catalog/body.h"
#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
#include "server/registry/memory/memory_budget.h"
#include "server/store/store.h"

namespace hulld::server {

// Requests the existing records with a prefix, or the one with an ID, in the order of IDs.
struct PageRequest {
  // Ignored unless `ids` is empty.
  std::string prefix = {};
  // At most one ID.
  std::vector<std::string> ids = {};
  RecordKinds kinds = {};
  // The page begins after this ID.
  std::string after = {};
  size_t page_size = 0;
};

// Existing hulls and bodies by ID, each of kind PRESENT, including damaged ones.
struct RecordPage {
  uint64_t store_revision = 0;
  std::vector<HullChange> entries = {};
  // True if more hulls or bodies follow.
  bool more = false;
};

// Reads the committed hulls and bodies page by page. Guarded by the registry's mutex.
class PageSource {
 public:
  // Calls `done` exactly once with the mutex held: before ReadPage returns if the tables contain
  // all records, otherwise later, on another thread. The page includes every change up to the
  // feed's revision at the time `done` is called, or up to a later one. UNAVAILABLE: the store
  // cannot be read.
  virtual void ReadPage(Locked& locked, PageRequest request,
                        std::function<void(Locked&, absl::StatusOr<RecordPage>)> done) = 0;

 protected:
  ~PageSource() = default;
};

// The hulls that a watch reports: those with a prefix, or a set of IDs.
struct WatchTarget {
  bool Includes(const std::string& id) const {
    return ids.empty() ? id.starts_with(prefix) : ids.contains(id);
  }
  bool operator==(const WatchTarget&) const = default;

  // Ignored unless `ids` is empty.
  std::string prefix = {};
  std::set<std::string> ids = {};
  // Includes bodies.
  bool bodies = false;
  // True: the watch first lists the existing hulls, by prefix or for a single ID. False: it reports
  // only later changes, because its reader reads existing hulls itself; it then reports every
  // deletion, and IDs can be added and removed (ChangeFeed::ChangeIds).
  bool lists_existing = true;
};

// The revision of a store after which a watch resumes; 0 if it does not resume.
struct WatchPosition {
  uint64_t after_revision = 0;
  std::string store_id = {};
};

// The next changes that a watch reports.
struct WatchBatch {
  // True if no change is pending. on_ready is then called once, when one arrives.
  bool waits = false;
  // Every change up to this revision was sent before, is in `changes`, or was superseded.
  uint64_t revision = 0;
  std::vector<HullChange> changes = {};
  // `synced` and `restarted` of v1::WatchHullsResponse.
  bool synced = false;
  bool restarted = false;
};

struct WatchGroup;

// A cursor in the changes of its target. Accessed only by the ChangeFeed, whose mutex guards it.
class Watch {
 public:
  // The order of opening, which does not depend on addresses.
  struct Order {
    bool operator()(const std::shared_ptr<Watch>& a, const std::shared_ptr<Watch>& b) const {
      return a->number_ < b->number_;
    }
  };
  using Set = std::set<std::shared_ptr<Watch>, Order>;

 private:
  friend class ChangeFeed;

  enum class State {
    // Reports deletions since it was last synced, if it resumes, then the existing hulls by ID.
    kCatchingUp,
    // The pending changes fill several batches. The state at the cursor is not that of any
    // revision, so hulls are reported as PRESENT or DELETED.
    kBehind,
    // Has reported exactly the state at the cursor.
    kSynced,
  };
  static constexpr uint64_t kNoDeletions = std::numeric_limits<uint64_t>::max();
  // Null: not requested. Without a value: in flight.
  using PendingPage = std::shared_ptr<std::optional<absl::StatusOr<RecordPage>>>;

  // Progress of kCatchingUp.
  struct CatchUp {
    // Existing hulls are listed if they changed after this revision.
    uint64_t after_revision = 0;
    // Deletions are reported after this revision; kNoDeletions: no more.
    uint64_t deletions_after = kNoDeletions;
    // The last listed ID.
    std::string last_id;
    // The next existing hulls, if they are read from the store.
    PendingPage page;
  };

  // Greater than the number of every watch that was open when this one was opened.
  uint64_t number_ = 0;
  std::shared_ptr<WatchGroup> group_;
  // Called on the feed's thread without locks.
  std::function<void()> on_ready_;
  State state_ = State::kSynced;
  CatchUp catch_up_;
  // Every change up to this revision was reported, or precedes the listing.
  uint64_t cursor_ = 0;
  // The cursor of the last batch that did not wait.
  uint64_t reported_ = 0;
  // The listing ended at this revision, and `synced` is due there.
  std::optional<uint64_t> synced_at_;
  // True if the next batch must report that the watch started over.
  bool restarted_ = false;
  // True if on_ready is due at the next change.
  bool is_waiting_ = false;
  // True if the next batch does not wait.
  bool is_nudged_ = false;
};

// The most recent deletions of hulls and bodies, in the order of their revisions, for watches that
// resume: a deletion leaves no trace in the store. Not thread-safe.
class DeletionLog {
 public:
  // Maximum number of deletions: 25 MiB with IDs of maximum length, outside the memory budget.
  static constexpr size_t kCapacity = 1 << 16;

  struct Deletion {
    uint64_t revision;
    std::string id;
    bool was_body;
  };

  // Starts an empty log at this revision.
  void Begin(uint64_t revision) { begin_ = revision; }
  // Adds a deletion. Requires a revision above that of the last deletion.
  void Add(const std::string& id, uint64_t revision, bool was_body);
  // Notes that a hull or body was created.
  void NoteCreation(const std::string& id, bool is_body);

  // Returns true if the log contains every deletion after this revision.
  bool IsCompleteAfter(uint64_t revision) const { return revision >= begin_; }
  // Returns the first deletion after this revision, or end().
  std::deque<Deletion>::const_iterator After(uint64_t revision) const;
  std::deque<Deletion>::const_iterator end() const { return log_.end(); }
  // Returns true if the ID has been unused since this deletion, or since later ones that a watch of
  // hulls does not report. bodies: bodies count, too. Requires a deletion in the log.
  bool IsFinal(const Deletion& deletion, bool bodies) const;

 private:
  // The last deletion of an ID that no hull has reused since.
  struct Last {
    uint64_t revision;
    // The last deletion of a hull with this ID; 0 if only bodies were deleted.
    uint64_t hull_revision;
    bool is_body_now = false;
  };

  std::deque<Deletion> log_;
  // The log is complete after this revision.
  uint64_t begin_ = 0;
  // Keys are the IDs in `log_`.
  std::unordered_map<std::string_view, Last> last_;
};

// Sends the initial state and then every change of hulls and bodies to watches. A watch first
// catches up: it reports deletions, if it resumes, and lists the existing hulls. Then it reports
// the changes noted since, and is synced whenever none is left.
//
// Invariant: a change during the listing is reported after it, so no change is missed.
//
// Watches of the same target share a group, which keeps the last change of each hull in the order
// of revisions; a watch is a cursor in it. A change thus costs O(log n) per group, however many
// watches it has, and a slow watch costs the number of changed hulls, not of changes. A group drops
// its changes when all of its watches have passed them. A watch starts over if its group, or the
// deletion log, has dropped a deletion that it needs.
//
// A watch without pending changes waits. The first change afterwards makes its group due, in O(1);
// the feed's thread then calls on_ready of all waiting watches of the group.
//
// Thread-safe: guarded by the registry's mutex, which the Note functions require.
class ChangeFeed {
 public:
  // Maximum number of hulls visited or reported before the mutex is released; takes about 50 us.
  static constexpr size_t kMaxPerBatch = 512;

  // All must outlive this. Pending changes are charged to the budget. mark_interval: the interval
  // at which a watch without changes learns the current revision.
  ChangeFeed(const Store& store, FairMutex& mutex, MemoryBudget& memory,
             std::chrono::milliseconds mark_interval);
  ChangeFeed(const ChangeFeed&) = delete;
  ChangeFeed& operator=(const ChangeFeed&) = delete;
  // Requires that all watches are closed.
  ~ChangeFeed();

  // Begins at the revision of the loaded store. Existing hulls are read from `pages`. Call before
  // all other functions.
  void Begin(uint64_t revision, PageSource& pages);
  // Revision of the last noted change. Requires the mutex.
  uint64_t revision() const { return revision_; }

  // Note a committed change at the revision of its record, or at `revision`. body: null for a
  // change of a hull. previous: the incarnation that had the ID before, possibly the same one;
  // nullopt: none. It is of the other kind if peer servers turned a hull into a body, or a body
  // into a hull, by several changes. Cost: O(log n) per group that includes the ID, and one hash
  // per length of a watched prefix.
  void NotePresent(Locked& locked, const std::optional<Incarnation>& previous,
                   const HullPointer& hull, const std::shared_ptr<const Body>& body);
  void NoteDeleted(Locked& locked, const std::string& id, const Incarnation& previous,
                   uint64_t revision);
  // Notes a revision whose change cannot be described; only the revision is reported.
  void NoteOther(const Locked& locked, uint64_t revision);

  // Starts a watch. Calls `on_ready` on the feed's thread, once after each batch that waits. A
  // watch that cannot resume starts over. RESOURCE_EXHAUSTED: --memory-limit is reached.
  absl::StatusOr<std::shared_ptr<Watch>> Open(const WatchTarget& target,
                                              const WatchPosition& position,
                                              std::function<void()> on_ready);
  // Returns the next changes, possibly none. Requires that the watch does not wait. UNAVAILABLE:
  // the watch was ended, or the store cannot be read; the next call reads again. Cost:
  // O(kMaxPerBatch).
  absl::StatusOr<WatchBatch> Next(const std::shared_ptr<Watch>& watch);
  // Adds and removes watched IDs, from the next change on. Requires a target with lists_existing =
  // false; `added` must be new to it, and `removed` included. Cost: one hash per ID.
  void ChangeIds(Watch& watch, std::span<const std::string> added,
                 std::span<const std::string> removed);
  // Calls on_ready of a waiting watch even though nothing changed.
  void Nudge(const std::shared_ptr<Watch>& watch);
  // Closes a watch. An on_ready that is already due is still called.
  void Close(const std::shared_ptr<Watch>& watch);
  // Ends and nudges all watches.
  void EndAll();

 private:
  using Groups = std::vector<std::shared_ptr<WatchGroup>>;
  using GroupsByName = absl::flat_hash_map<std::string, Groups>;

  // A change of the hull or body with an ID.
  struct Change {
    ChangeKind kind = ChangeKind::kDeleted;
    bool is_body = false;
    uint64_t revision = 0;
    // Start of the current incarnation, or of the deleted one.
    uint64_t create_revision = 0;
    // Both null for a deletion.
    HullPointer hull = nullptr;
    std::shared_ptr<const Body> body = nullptr;
    // create_revision of the previous incarnation if the change replaced a hull with a body, or a
    // body with a hull; otherwise 0.
    uint64_t other_kind_began = 0;
  };
  friend struct WatchGroup;

  static std::optional<Change> AsReportedTo(const WatchTarget& target, const Change& change);
  void Note(Locked& locked, const std::string& id, const Change& change);
  void NoteFor(Locked& locked, const std::shared_ptr<WatchGroup>& group, const std::string& id,
               const Change& change);

  std::shared_ptr<WatchGroup> GroupOf(const WatchTarget& target);
  void RemoveGroup(const std::shared_ptr<WatchGroup>& group);
  static void Remove(GroupsByName& groups, const std::string& name,
                     const std::shared_ptr<WatchGroup>& group);
  void DropChanges(WatchGroup& group);

  bool IsLost(const Watch& watch) const;
  void Restart(Watch& watch);
  void BeginCatchUp(Watch& watch, uint64_t after_revision);
  void AddDeletions(Watch& watch, WatchBatch* batch);
  absl::Status AddExisting(Locked& locked, const std::shared_ptr<Watch>& watch, WatchBatch* batch);
  void AddChanges(Watch& watch, WatchBatch* batch);
  void MoveCursor(Watch& watch, uint64_t revision);

  void Wait(Watch& watch, WatchBatch* batch);
  void Wake(Locked& locked, const std::shared_ptr<Watch>& watch);
  void MakeReady(const std::shared_ptr<Watch>& watch);
  // Run on the feed's thread.
  void Run();
  void NudgeForMarks();

  const Store& store_;
  FairMutex& mutex_;
  MemoryBudget& memory_;
  const std::chrono::milliseconds mark_interval_;

  // The members below are guarded by mutex_.
  PageSource* pages_ = nullptr;
  uint64_t revision_ = 0;
  DeletionLog deletions_;
  GroupsByName by_prefix_;
  // Number of groups by length of their prefix.
  std::map<size_t, size_t> prefix_lengths_;
  GroupsByName by_id_;
  Watch::Set watches_;
  // Covers all pending changes.
  MemoryCharge charge_;

  // Work for the feed's thread.
  ConditionVariable wake_;
  Groups due_;
  std::vector<std::shared_ptr<Watch>> ready_;
  bool has_ended_ = false;
  bool is_stopping_ = false;
  Thread thread_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_WATCH_CHANGE_FEED_H_
