#ifndef HULLD_SERVER_REGISTRY_WATCH_CHANGE_WATCH_H_
#define HULLD_SERVER_REGISTRY_WATCH_CHANGE_WATCH_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/registry/catalog/registry_types.h"
#include "server/registry/memory/locked.h"
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

// A watch resumes after this revision of this store. 0: it does not resume.
struct WatchPosition {
  uint64_t after_revision = 0;
  std::string store_id = {};
};

// The next changes that a watch reports.
struct WatchBatch {
  // No change is pending; the watch's on_ready will be called once when one is.
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

}  // namespace hulld::server

#endif  // HULLD_SERVER_REGISTRY_WATCH_CHANGE_WATCH_H_
