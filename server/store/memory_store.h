#ifndef HULLD_SERVER_STORE_MEMORY_STORE_H_
#define HULLD_SERVER_STORE_MEMORY_STORE_H_

#include <string>
#include <vector>

#include "server/contract/errors.h"
#include "server/process/random_id.h"
#include "server/store/store.h"

namespace hulld::server {

// A store that stores nothing: the registry keeps everything in memory. Each start creates a new
// store.
class MemoryStore : public Store {
 public:
  std::string kind() const override { return "memory"; }
  const std::string& id() const override { return id_; }
  Durability durability() const override { return Durability::kMemory; }
  bool keeps_hulls() const override { return false; }
  uint64_t revision() const override { return revision_; }
  absl::Status ForEachRecord(const StoredHullVisitor&, const StoredBodyVisitor&) override {
    return absl::OkStatus();
  }
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull&) override {
    return absl::NotFoundError("an in-memory store has no stored records");
  }
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord&, const std::string&) override {
    return 0;
  }
  absl::Status Commit(std::span<Change* const> changes) override {
    revision_ = NumberChanges(changes, revision_);
    return absl::OkStatus();
  }
  absl::Status Recover() override { return absl::OkStatus(); }
  absl::StatusOr<std::string> MakeCopy() override {
    return WithReason(
        absl::FailedPreconditionError("an in-memory store (--store=memory) cannot be backed up; "
                                      "use --store=rocksdb or --store=postgres"),
        v1::ERROR_REASON_STORE_IN_MEMORY);
  }

 private:
  const std::string id_ = RandomId();
  uint64_t revision_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_MEMORY_STORE_H_
