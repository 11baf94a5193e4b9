#ifndef HULLD_TESTS_SERVER_SCHEDULES_STORE_SIMULATED_STORE_H_
#define HULLD_TESTS_SERVER_SCHEDULES_STORE_SIMULATED_STORE_H_

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/process/synchronization.h"
#include "server/store/store.h"
#include "tests/server/schedules/ledger.h"

namespace hulld::server {

class SharedStore;

// Fault frequencies: one in this many calls; 0: never.
struct StoreFaults {
  // A batch is refused without effect (refused), or with an unknown effect until Recover succeeds
  // (unknown).
  uint32_t refused = 0;
  uint32_t unknown = 0;
  // The disk is full: RESOURCE_EXHAUSTED.
  uint32_t full = 0;
  uint32_t recover = 0;
  // Points or a sequence are temporarily unreadable.
  uint32_t read = 0;
  // Points are permanently damaged.
  uint32_t damage = 0;
  // The process is killed at this batch, counted from 1; 0: never.
  uint32_t killed_at_batch = 0;
};

// A store that behaves as Store specifies and as the durable one, with faults chosen by the
// schedule. Other threads may run before and after each call. It records its contents in a Ledger,
// which checks every change. It survives a killed process: Reopen.
class SimulatedStore : public Store {
 public:
  // Number of occurrences of each event.
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
    // Changes superseded by another server's (SharedStore).
    uint64_t superseded = 0;
  };

  explicit SimulatedStore(const StoreFaults& faults) : faults_(faults) {}

  std::string kind() const override { return "simulated"; }
  const std::string& id() const override { return id_; }
  Durability durability() const override { return Durability::kSync; }
  bool keeps_hulls() const override { return true; }
  uint64_t revision() const override { return ledger_.revision(); }
  absl::Status ForEachRecord(const StoredHullVisitor& visit_hull,
                             const StoredBodyVisitor& visit_body) override;
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override;
  bool supports_lookup() const override { return finds_records_; }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override;
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t limit, RecordKinds kinds) override;
  StoreTotals totals() const override;
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override;
  absl::StatusOr<std::string> MakeCopy() override;

  // Call before use.
  void SetFindsRecords(bool supports_lookup) { finds_records_ = supports_lookup; }
  Ledger& ledger() { return ledger_; }
  const Counts& counts() const { return counts_; }
  // Failures that may have been reported to calls by now; the second also counts one still in
  // progress. One record lookup may answer many calls, including calls that arrive while it runs.
  uint64_t answered_failures() const {
    return failed() - (is_failing_ ? 1 : 0) - failing_servers_ - counts_.failed_lookups;
  }
  uint64_t failed() const { return counts_.refused + counts_.unknown + counts_.failed_reads; }
  bool was_full() const { return was_full_; }
  bool is_damaged(uint64_t create_revision) const { return damaged_.contains(create_revision); }
  bool has_damage() const { return !damaged_.empty(); }
  bool was_killed() const { return is_dead_; }

  // Opens the contents for the next process. faults: from now on.
  void Reopen(const StoreFaults& faults);

 private:
  // The store as seen by several servers.
  friend class SharedStore;

  // Stored data of a hull.
  struct StoredVertices {
    StoredHull stored;
    // Each with the revision that added it.
    std::vector<std::pair<uint64_t, Vector>> vertices;
    std::map<std::string, uint64_t> sequences;
  };

  // A stored change: its hull or body, its revision, and the incarnation that it ended, if any.
  struct Logged {
    std::string hull_id;
    uint64_t revision = 0;
    uint64_t ended_at = 0;
    std::optional<Incarnation> previous = {};
  };

  absl::Status RefuseBatch(std::span<const Change* const> changes);
  void Keep(const Change& change, bool nobody_waits);
  void KeepBody(const Change& change);

  const std::string id_ = "simulated";
  StoreFaults faults_;
  bool finds_records_ = false;
  Ledger ledger_;
  Counts counts_;
  std::map<std::string, StoredVertices> hulls_;
  std::map<std::string, StoredBody> bodies_;
  // Changes of unknown outcome, which the next process may find.
  std::vector<Change> unknown_;
  // Incarnations, by their first revisions.
  std::set<uint64_t> damaged_;
  bool is_busy_ = false;
  bool is_failing_ = false;
  bool was_full_ = false;
  bool is_dead_ = false;

  std::vector<Logged> log_;
  // For SharedStore: the number of servers with a failed last batch; and all servers, guarded by
  // the mutex.
  uint64_t failing_servers_ = 0;
  Mutex servers_mutex_;
  std::vector<SharedStore*> servers_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_STORE_SIMULATED_STORE_H_
