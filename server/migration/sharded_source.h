#ifndef HULLD_SERVER_MIGRATION_SHARDED_SOURCE_H_
#define HULLD_SERVER_MIGRATION_SHARDED_SOURCE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace hulld::server {

// What a migration copies into one store, of one that holds more or of several: the hulls and
// bodies of some slots, in byte order of their IDs. To be read alone.
class ShardedSource : public Store {
 public:
  using HasId = std::function<bool(const std::string& id)>;
  using StoreOfId = std::function<size_t(const std::string& id)>;

  // has: whether an ID is to be copied. store_of: which of the stores holds it. The stores must
  // outlive this.
  ShardedSource(std::span<Store* const> stores, HasId has, StoreOfId store_of);

  std::string kind() const override { return stores_.front()->kind(); }
  // The ID of the one store; of several, all IDs, joined by "+".
  std::string id() const override;
  Durability durability() const override { return stores_.front()->durability(); }
  bool keeps_hulls() const override { return true; }
  // The greatest: every revision that was given is at most this.
  uint64_t revision() const override;
  // With several stores, all records are kept in memory for the time of the visit.
  absl::Status ForEachHull(const StoredHullVisitor& visit) override;
  absl::Status ForEachBody(const StoredBodyVisitor& visit) override;
  absl::StatusOr<std::vector<Vector>> LoadVertices(const StoredHull& hull) override {
    return StoreOf(hull.record.hull_id).LoadVertices(hull);
  }
  absl::StatusOr<uint64_t> LoadSequence(const HullRecord& hull,
                                        const std::string& writer_id) override {
    return StoreOf(hull.hull_id).LoadSequence(hull, writer_id);
  }
  absl::StatusOr<std::vector<WriterSequence>> LoadWriters(const StoredHull& hull) override {
    return StoreOf(hull.record.hull_id).LoadWriters(hull);
  }
  absl::Status Commit(std::span<Change* const> changes) override;
  absl::Status Recover() override { return absl::OkStatus(); }
  absl::StatusOr<std::string> MakeCopy() override;

 private:
  Store& StoreOf(const std::string& id) { return *stores_[store_of_(id)]; }

  const std::vector<Store*> stores_;
  const HasId has_;
  const StoreOfId store_of_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_MIGRATION_SHARDED_SOURCE_H_
