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

// What one of several servers has of a SimulatedStore, which then is the database that they share:
// it works as Store says of a store that is shared. Others may go on before and after each call.
// The database outlives it.
class SharedStore : public Store {
 public:
  explicit SharedStore(SimulatedStore& database);
  ~SharedStore() override;

  std::string kind() const override { return "shared"; }
  std::string id() const override { return database_.id(); }
  Durability durability() const override { return Durability::kSync; }
  bool keeps_hulls() const override { return true; }
  bool is_shared() const override { return true; }
  uint64_t revision() const override { return known_.revision; }
  absl::Status ForEachHull(const StoredHullVisitor& visit) override;
  // There are none, unless records are found.
  absl::Status ForEachBody(const StoredBodyVisitor&) override { return absl::OkStatus(); }
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override;
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override;
  bool finds_records() const override { return database_.finds_records(); }
  absl::StatusOr<FoundRecords> FindRecords(std::span<const std::string> ids) override {
    return database_.FindRecords(ids);
  }
  absl::StatusOr<FoundRecords> ListRecords(const std::string& prefix, const std::string& after,
                                           size_t most, RecordKinds kinds) override {
    return database_.ListRecords(prefix, after, most, kinds);
  }
  StoreTotals totals() const override { return known_.totals; }
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override;
  absl::StatusOr<std::string> MakeCopy() override { return database_.MakeCopy(); }
  absl::Status Follow() override;
  void StartFollow() override;
  OtherChanges TakeOthers() override { return std::exchange(known_.others, {}); }
  void OnOthers(std::function<void()> others) override;

 private:
  void Begin(const char* what, uint64_t number);
  absl::Status End(const char* what, const absl::Status& status);
  void NoteOthers();
  void NoteEnd(bool failed);
  absl::Status CommitInTurn(std::span<Change* const> changes);
  void TellTheOthers();
  // What is kept of a hull, if it is the one of the record.
  const SimulatedStore::Kept* Find(const HullRecord& record) const;

  // What this knows of the database.
  struct Known {
    // Its changes.
    size_t seen = 0;
    uint64_t revision = 0;
    // As of that revision.
    StoreTotals totals = {};
    // That nobody took yet.
    OtherChanges others = {};
  };

  SimulatedStore& database_;
  Known known_;
  // What is on its way to Follow: what was known when it was asked for.
  std::optional<Known> started_;
  // Guarded by the database's mutex.
  std::function<void()> on_others_;
  bool is_busy_ = false;
  bool is_failing_ = false;
  bool has_followed_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SCHEDULES_STORE_SHARED_STORE_H_
