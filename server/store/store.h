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
#include "server/store/body_record.h"
#include "server/store/hull_record.h"
#include "server/store/other_changes.h"

namespace hulld::server {

// What a committed change survives.
enum class Durability {
  kMemory,   // nothing: it is lost when the server ends
  kRelaxed,  // the end of the server, but not that of the machine within some time
  kSync,     // both: it is on disk
};

struct WriterSequence {
  std::string writer_id;
  uint64_t sequence = 0;

  friend bool operator==(const WriterSequence&, const WriterSequence&) = default;
};

// What a change means for the vertices that are kept of its hull.
enum class VertexChange {
  kNone,
  // Change::vertices are one more delta.
  kAdded,
  // Change::vertices are the new base and take the place of all that is kept.
  kReplaced,
};

// One hull, or one body, created, changed or deleted. The store gives it its revisions as it
// commits it (NumberChanges); until then those in `hull`, in its layouts and in `body` mean
// nothing, but for what is deleted or replaced.
struct Change {
  // The hull after the change; what is deleted if it is.
  StoredHull hull;
  // The store's revision after the change; hull.record.revision is lower where no vertex changed.
  uint64_t revision = 0;
  // Whether that is a new one: not where points came and no vertex changed.
  bool takes_revision = true;
  // Whether this is a new incarnation of the hull, or the beginning of the body.
  bool begins = false;
  bool deleted = false;
  // For a body that begins: whether it takes the place of one, such as one that is damaged.
  bool replaces_body = false;
  // A change of a hull that neither begins nor ends: its revisions when all changes that were
  // submitted before are committed, and those of the same batch are not.
  std::shared_ptr<const HullRevisions> before;
  // How many vertices the hull had before, where it neither begins nor ends.
  uint64_t former_vertices = 0;
  // How the hull's vertices were kept before.
  VertexLayout former_layout;
  VertexChange vertex_change = VertexChange::kNone;
  std::vector<Vector> vertices;
  // The writer of the chunk, if the change is one.
  std::optional<WriterSequence> writer;
  // The incarnation that this one takes the place of, if there is one.
  std::optional<StoredHull> replaced;
  // The body after the change, or what is deleted if it is. Then no field about a hull is used.
  std::shared_ptr<StoredBody> body;

  const std::string& id() const {
    return body != nullptr ? body->record.body_id : hull.record.hull_id;
  }
};

// A hull that a store holds: its ID, and the rest, or DATA_LOSS naming the hull when what is kept
// of it is damaged.
using StoredHullVisitor = std::function<void(const std::string&, absl::StatusOr<StoredHull>)>;

// The same for bodies.
using StoredBodyVisitor = std::function<void(const std::string&, absl::StatusOr<StoredBody>)>;

// What a store holds of hulls and bodies that were asked for, all of it of one moment.
struct FoundRecords {
  // The store's revision at that moment.
  uint64_t revision = 0;
  // Those that are there: their IDs, and the rest, or DATA_LOSS naming the hull, or the body.
  std::map<std::string, absl::StatusOr<StoredHull>> hulls;
  std::map<std::string, absl::StatusOr<StoredBody>> bodies;
  // For a list: whether there are others after these.
  bool more = false;
};

// What a list is of.
struct RecordKinds {
  bool hulls = false;
  bool bodies = false;
};

// Operations that failed so far, each counted once, by what the system refused.
struct StoreFailures {
  // Writing, and opening anew after an error.
  uint64_t write = 0;
  uint64_t sync = 0;
  // What could not be read; what was read and is damaged is not among them.
  uint64_t read = 0;
};

// What a store takes of its disk, and whether it keeps up with what is written.
struct StoreDisk {
  // All its files, and the log among them.
  uint64_t bytes = 0;
  uint64_t log_bytes = 0;
  // What the disk has left for it; none where that is not known.
  std::optional<uint64_t> free_bytes;
  // How often changes were slowed down or stopped since the store was opened, which never goes
  // back, and whether they are.
  uint64_t stalls = 0;
  bool is_stalled = false;
};

// Where changes are kept, beside the registry that serves them. Any thread may read.
class Store {
 public:
  virtual ~Store() = default;

  // As in --store.
  virtual std::string kind() const = 0;
  // Random per store.
  virtual std::string id() const = 0;
  virtual Durability durability() const = 0;
  // Whether hulls can be read back: what the registry holds of them is then a copy.
  virtual bool keeps_hulls() const = 0;
  // The last one committed. Never while Commit runs.
  virtual uint64_t revision() const = 0;

  // Every hull, in byte order of the IDs.
  virtual absl::Status ForEachHull(const StoredHullVisitor& visit) = 0;
  // Every body, likewise.
  virtual absl::Status ForEachBody(const StoredBodyVisitor& visit) = 0;
  // Points whose hull `hull` is. DATA_LOSS naming the hull: something is missing or damaged.
  virtual absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) = 0;
  // The same of each, in their order. Holds all that it read until it returns.
  virtual std::vector<absl::StatusOr<std::vector<Vector>>> LoadVerticesOfEach(
      std::span<const StoredHull* const> hulls) {
    std::vector<absl::StatusOr<std::vector<Vector>>> loaded;
    loaded.reserve(hulls.size());
    for (const StoredHull* const hull : hulls) loaded.push_back(LoadVertices(*hull));
    return loaded;
  }
  // The writer's last committed sequence; 0 when there is none.
  virtual absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                                const std::string& writer_id) = 0;

  // Whether records can be looked up one by one at little cost, so that nobody needs to read all of
  // them at first. What is found holds everything that was committed by the time of the call, by
  // this server or another. UNAVAILABLE: the store cannot be read.
  virtual bool finds_records() const { return false; }
  // What there is under these IDs, hulls and bodies.
  virtual absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> /*ids*/) {
    return absl::UnimplementedError("this store does not find records");
  }
  // At most `most` records, of these kinds, whose IDs start with `prefix` and come after `after`,
  // in byte order. Fewer, but one at least, where they take more than kMostListedBytes.
  virtual absl::StatusOr<FoundRecords> ListRecords(const std::string& /*prefix*/,
                                                   const std::string& /*after*/, size_t /*most*/,
                                                   RecordKinds /*kinds*/) {
    return absl::UnimplementedError("this store does not find records");
  }
  static constexpr uint64_t kMostListedBytes = 16 << 20;
  // What there is at revision(), where records are found. Never while Commit runs.
  virtual StoreTotals totals() const { return {}; }

  // Every writer of the hull, in byte order of the IDs; as many as are there. FAILED_PRECONDITION:
  // nothing is kept.
  virtual absl::StatusOr<std::vector<WriterSequence>> LoadWriters(const StoredHull& /*hull*/) {
    return absl::FailedPreconditionError("this store keeps no writers to read back");
  }

  // Gives changes their revisions, and keeps them, all or none, before anyone can see them: one
  // call at a time, in the order in which they take effect. An error refuses them all, and what is
  // kept is as before, also for a process that opens the store after this one was killed; unless
  // the error is UNAVAILABLE and says that this is not known: then the next process may find them,
  // until Recover succeeds.
  virtual absl::Status Commit(std::span<Change* const> changes) = 0;
  // After an error: makes Commit possible again, or says why it is not. Never while Commit runs.
  virtual absl::Status Recover() = 0;

  virtual StoreFailures failures() const { return {}; }

  // None where nothing is on disk. Cost: O(files), some 10 us each.
  virtual std::optional<StoreDisk> disk() const { return std::nullopt; }

  // Makes a consistent copy of all that is kept, as of some moment during the call, and returns its
  // directory, which the caller removes. FAILED_PRECONDITION: nothing is kept.
  virtual absl::StatusOr<std::string> MakeCopy() = 0;

  // Whether other servers may commit to the same store while this one is open. Then Commit leaves
  // out, of the changes that it is given, all of an ID that is in what TakeOthers is about to give:
  // they were made from a state that is no longer the last. LoadVertices and LoadSequence answer
  // ABORTED where the hull was changed since. Follow finds out what others have committed by the
  // time of the call; never while Commit or Recover runs. UNAVAILABLE: the store cannot be asked.
  virtual bool is_shared() const { return false; }
  virtual absl::Status Follow() { return absl::OkStatus(); }
  // Sends what the next Follow asks, which then finds out what others have committed by the time of
  // this call. Waits for nothing, so on any thread; Follow comes before anything else that may not
  // run while it does. Where it cannot be sent, Follow asks as ever.
  virtual void StartFollow() {}
  // What Commit and Follow found, whether they failed or not, since this was called last.
  virtual OtherChanges TakeOthers() { return {}; }
  // For each hull the points of its deltas between the two versions, in their order; none where
  // they are not there as the versions say, as after the hull was given a new base, or cannot be
  // read. All of them are asked for at once. Never while Commit, Recover or Follow runs.
  virtual std::vector<std::optional<std::vector<Vector>>> LoadGrowth(
      std::span<const HullGrowth> hulls) {
    return std::vector<std::optional<std::vector<Vector>>>(hulls.size());
  }
  // From when this returns OK until ReleaseOthers, no other server commits; what they had committed
  // is found as by Follow. The store may let them go on earlier if that does not come soon. Never
  // while Commit, Recover or Follow runs, nor may these run in between. UNAVAILABLE: the store
  // cannot be asked, or others hold it.
  virtual absl::Status HoldOthers() { return absl::OkStatus(); }
  // Requires that HoldOthers returned OK. Returns whether nobody has committed since; false also
  // where that is not known.
  virtual bool ReleaseOthers() { return true; }
  // `others` is called, on any thread, soon after other servers committed: a reason to Follow.
  virtual void OnOthers(std::function<void()> /*others*/) {}

  // `ended` is called, on any thread, once nothing can be committed or read here any more because
  // another server took the store over; at once if that is so already. The process is to end then.
  virtual void OnEnded(std::function<void()> /*ended*/) {}

  // Whether the next change is to bring a new base instead of a delta of `new_vertices`: once the
  // deltas outgrew the base, so that all bases together are as large as all deltas, a few times at
  // most. Each kept delta costs kDeltaBytes beside its vertices.
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
