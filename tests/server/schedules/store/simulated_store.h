#ifndef HULLD_TESTS_SERVER_SCHEDULES_STORE_SIMULATED_STORE_H_
#define HULLD_TESTS_SERVER_SCHEDULES_STORE_SIMULATED_STORE_H_

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/process/synchronization.h"
#include "server/store/store.h"
#include "tests/server/schedules/ledger.h"

namespace hulld::server {

class SharedStore;

// How often something fails: once in this many calls; 0: never.
struct StoreFaults {
  // A batch is refused and nothing is left of it; it may be so, or not, until Recover succeeds.
  uint32_t refused = 0;
  uint32_t unknown = 0;
  // The disk is full: RESOURCE_EXHAUSTED.
  uint32_t full = 0;
  uint32_t recover = 0;
  // Points, or a sequence, cannot be read now.
  uint32_t read = 0;
  // Points are found to be damaged, and stay so.
  uint32_t damage = 0;
  // The process is killed at this batch, from 1; 0: at none.
  uint32_t killed_at_batch = 0;
};

// A store that works as Store says and as the durable one does, with faults that the schedule
// chooses. Others may go on before and after each call. It keeps what it should in a Ledger, which
// checks every change. It outlives the process that was killed: Reopen.
class SimulatedStore : public Store {
 public:
  // How often each happened.
  struct Counts {
    uint64_t batches = 0;
    uint64_t refused = 0;
    uint64_t unknown = 0;
    uint64_t recovered = 0;
    uint64_t failed_reads = 0;
    uint64_t loads = 0;
    uint64_t sequences = 0;
    uint64_t lookups = 0;
    uint64_t failed_lookups = 0;
    uint64_t kills = 0;
    uint64_t revived = 0;
    // Changes that another server's superseded (SharedStore).
    uint64_t superseded = 0;
  };

  explicit SimulatedStore(const StoreFaults& faults) : faults_(faults) {}

  std::string kind() const override { return "simulated"; }
  std::string id() const override { return "simulated"; }
  Durability durability() const override { return Durability::kSync; }
  bool keeps_hulls() const override { return true; }
  uint64_t revision() const override { return ledger_.revision(); }
  absl::Status ForEachHull(const StoredHullVisitor& visit) override;
  absl::Status ForEachBody(const StoredBodyVisitor& visit) override;
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override;
  bool finds_records() const override { return finds_records_; }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override;
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t most, RecordKinds kinds) override;
  StoreTotals totals() const override;
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override;
  absl::StatusOr<std::string> MakeCopy() override;

  // Before it is used.
  void SetFindsRecords(bool finds_records) { finds_records_ = finds_records; }
  Ledger& ledger() { return ledger_; }
  const Counts& counts() const { return counts_; }
  // Failures that calls may have been answered with by now; and with them one that they may yet.
  // One lookup of a record may answer many calls, also such as come while it is under way.
  uint64_t answered_failures() const {
    return failed() - (is_failing_ ? 1 : 0) - failing_servers_ - counts_.failed_lookups;
  }
  uint64_t failed() const { return counts_.refused + counts_.unknown + counts_.failed_reads; }
  bool was_full() const { return was_full_; }
  bool is_damaged(uint64_t create_revision) const { return damaged_.contains(create_revision); }
  bool has_damage() const { return !damaged_.empty(); }
  bool was_killed() const { return is_dead_; }

  // What the next process finds. faults: from now on.
  void Reopen(const StoreFaults& faults);

 private:
  // As which several servers have it.
  friend class SharedStore;

  // What is kept of a hull.
  struct Kept {
    StoredHull stored;
    // Each with the revision that brought it.
    std::vector<std::pair<uint64_t, Vector>> vertices;
    std::map<std::string, uint64_t> sequences;
  };

  // A change that was kept: which hull or body it changed, at which revision, and whether an
  // incarnation ended then.
  struct Logged {
    std::string hull_id;
    uint64_t revision = 0;
    uint64_t ended_at = 0;
    // When that incarnation began, and whether it was a body's.
    uint64_t former_began = 0;
    bool former_was_body = false;
  };

  absl::Status RefuseBatch(std::span<const Change* const> changes);
  void Keep(const Change& change, bool nobody_waits);
  void KeepBody(const Change& change);

  StoreFaults faults_;
  bool finds_records_ = false;
  Ledger ledger_;
  Counts counts_;
  std::map<std::string, Kept> hulls_;
  std::map<std::string, StoredBody> bodies_;
  // What the next process may find.
  std::vector<Change> unknown_;
  // Incarnations, by their first revisions.
  std::set<uint64_t> damaged_;
  bool is_busy_ = false;
  bool is_failing_ = false;
  bool was_full_ = false;
  bool is_dead_ = false;

  std::vector<Logged> log_;
  // For SharedStore: how many servers' last batch failed; and all of the servers, guarded by the
  // mutex.
  uint64_t failing_servers_ = 0;
  Mutex servers_mutex_;
  std::vector<SharedStore*> servers_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_STORE_SIMULATED_STORE_H_
