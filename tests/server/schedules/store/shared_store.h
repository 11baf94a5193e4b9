#ifndef HULLD_TESTS_SERVER_SCHEDULES_STORE_SHARED_STORE_H_
#define HULLD_TESTS_SERVER_SCHEDULES_STORE_SHARED_STORE_H_

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "tests/server/schedules/store/simulated_store.h"

namespace hulld::server {

// A server's view of a SimulatedStore that several servers share as their database. It behaves as
// PeerFeed specifies. Other threads may run before and after each call. The database
// outlives it.
class SharedStore : public Store, public PeerFeed {
 public:
  explicit SharedStore(SimulatedStore& database);
  ~SharedStore() override;

  std::string kind() const override { return "shared"; }
  const std::string& id() const override { return database_.id(); }
  Durability durability() const override { return Durability::kSync; }
  bool keeps_hulls() const override { return true; }
  PeerFeed* peers() override { return this; }
  uint64_t revision() const override { return known_.revision; }
  // Without record lookup no bodies exist.
  absl::Status ForEachRecord(const StoredHullVisitor& visit_hull,
                             const StoredBodyVisitor&) override;
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override;
  bool supports_lookup() const override { return database_.supports_lookup(); }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override {
    return database_.FindRecords(ids);
  }
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t limit, RecordKinds kinds) override {
    return database_.ListRecords(prefix, after, limit, kinds);
  }
  StoreTotals totals() const override { return known_.totals; }
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override;
  absl::StatusOr<std::string> MakeCopy() override { return database_.MakeCopy(); }
  absl::Status Fetch() override;
  void StartFetch() override;
  PeerChanges TakeChanges() override { return std::exchange(known_.peer_changes, {}); }
  void OnPeerCommit(std::function<void()> committed) override;

 private:
  void Begin(const char* what, uint64_t number);
  absl::Status End(const char* what, const absl::Status& status);
  void NotePeerChanges();
  void NoteEnd(bool failed);
  absl::Status CommitInTurn(std::span<Change* const> changes);
  void NotifyPeers();
  // Returns the stored data of a hull if it matches the record, or null.
  const SimulatedStore::StoredVertices* Find(const HullRecord& record) const;

  // This server's knowledge of the database.
  struct Known {
    // Database changes seen.
    size_t seen = 0;
    uint64_t revision = 0;
    // As of that revision.
    StoreTotals totals = {};
    // Peer changes not yet taken.
    PeerChanges peer_changes = {};
  };

  SimulatedStore& database_;
  Known known_;
  // The state captured when a pending Fetch started.
  std::optional<Known> started_;
  // Guarded by the database's mutex.
  std::function<void()> on_peer_commit_;
  bool is_busy_ = false;
  bool is_failing_ = false;
  bool has_fetched_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_STORE_SHARED_STORE_H_
