#ifndef HULLD_TESTS_SERVER_SHARDS_SHARDS_FIXTURE_H_
#define HULLD_TESTS_SERVER_SHARDS_SHARDS_FIXTURE_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/process/worker_pool.h"
#include "server/shards/body_resolution.h"
#include "server/shards/shards.h"
#include "server/store/memory_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {

// Shards over stores in memory: slots go to them in turn.
class ShardsTest : public ::testing::Test {
 protected:
  static constexpr size_t kShards = 3;

  ShardsTest() { Begin({}); }

  void Begin(const Limits& limits) {
    shards_ = nullptr;
    stores_.clear();
    std::vector<Store*> stores;
    for (size_t i = 0; i < kShards; ++i) {
      stores_.push_back(std::make_unique<MemoryStore>());
      stores.push_back(stores_.back().get());
    }
    Shards::ShardOfSlot shard_of_slot{};
    for (size_t slot = 0; slot < kSlots; ++slot) {
      shard_of_slot[slot] = static_cast<uint16_t>(slot % kShards);
    }
    const std::vector<WorkerPool*> writers(stores.size(), &writers_);
    shards_ = std::make_unique<Shards>(stores, shard_of_slot, limits, writers);
    EXPECT_TRUE(shards_->Load().ok());
  }

  template <typename T, typename Call>
  static absl::StatusOr<T> Wait(const Call& call) {
    return MemoryRegistry::Wait<T>(call);
  }

  // An ID of this shard that starts with the prefix; another one for another number.
  std::string IdIn(size_t shard, const std::string& prefix = "hull", int number = 0) const {
    for (int i = 0;; ++i) {
      std::string id = prefix + std::to_string(i);
      if (shards_->shard_of(id) == shard && number-- == 0) return id;
    }
  }

  absl::StatusOr<CreateResult> Create(const std::string& id) {
    return Wait<CreateResult>(
        [&](Reply<CreateResult> done) { shards_->of(id).Create(id, false, std::move(done)); });
  }
  absl::StatusOr<uint64_t> Delete(const std::string& id) {
    return Wait<uint64_t>(
        [&](Reply<uint64_t> done) { shards_->of(id).Delete(id, std::nullopt, std::move(done)); });
  }
  // Puts a new hull in the place of what there is; returns its revision.
  uint64_t Replace(const std::string& id, std::vector<Vector> points = CubeCorners()) {
    Replacement replacement;
    replacement.hull_id = id;
    replacement.create_if_absent = true;
    replacement.builder = std::make_shared<HullBuilder>();
    replacement.counts = *replacement.builder->Add(points);
    const auto replaced = Wait<ReplaceResult>([&](Reply<ReplaceResult> done) {
      shards_->of(id).Replace(std::move(replacement), std::move(done));
    });
    EXPECT_TRUE(replaced.ok()) << replaced.status();
    return replaced.ok() ? replaced->hull.revision : 0;
  }
  absl::Status PutBody(const std::string& id, const std::vector<std::string>& hulls) {
    StoredBody body;
    body.record.body_id = id;
    body.hull_ids = hulls;
    for (uint32_t i = 0; i < hulls.size(); ++i) body.pieces.push_back({i, Pose()});
    return Wait<PutBodyResult>([&](Reply<PutBodyResult> done) {
             shards_->of(id).PutBody(std::move(body), std::nullopt, std::move(done));
           })
        .status();
  }

  absl::StatusOr<ShardsResolved> Resolve(const std::vector<std::string>& ids,
                                         const ShardsPlan& plan = {}) {
    KnownInShards known;
    return shards_->Refresh(ids, known, {}, plan);
  }

  WorkerPool writers_{2};
  std::vector<std::unique_ptr<MemoryStore>> stores_;
  std::unique_ptr<Shards> shards_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SHARDS_SHARDS_FIXTURE_H_
