#ifndef HULLD_TESTS_SERVER_SHARDS_SHARDED_HISTORIES_H_
#define HULLD_TESTS_SERVER_SHARDS_SHARDED_HISTORIES_H_

#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/shards/slots.h"
#include "tests/server/harness/postgres/cutting_proxy.h"
#include "tests/server/harness/postgres/many_servers.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {

// Servers over two databases, each server with a network of its own to each, and clients that call
// about hulls of both, and about bodies with pieces in both, at any freshness.
class ShardedHistories : public ManyServersTest {
 protected:
  static constexpr size_t kShards = 2;
  // In the first and in the second half of the slots: two hulls and two bodies.
  static constexpr const char* kHulls[] = {"shared/a", "shared/c"};
  static constexpr const char* kBodies[] = {"body/a", "body/c"};
  // Several times what an answer takes that is not delayed.
  static constexpr std::chrono::milliseconds kFar{5};

  void SetUp() override {
    ManyServersTest::SetUp();
    if (IsSkipped()) return;
    for (const auto& ids : {kHulls, kBodies}) {
      ASSERT_LT(SlotOf(ids[0]), kSlots / 2);
      ASSERT_GE(SlotOf(ids[1]), kSlots / 2);
    }
    std::string name = ::testing::TempDir() + "hulld_histories_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  void TearDown() override {
    if (!directory_.empty()) std::filesystem::remove_all(directory_);
  }

  // kServers over two empty databases, each server and database with a network of its own between.
  void BeginBehindProxies() {
    PostgresCluster& cluster = PostgresCluster::Shared();
    proxies_.clear();
    std::vector<std::string> databases;
    for (size_t shard = 0; shard < kShards; ++shard) databases.push_back(cluster.MakeDatabase());
    std::vector<std::string> files;
    for (size_t i = 0; i < kServers; ++i) {
      files.push_back(absl::StrCat(directory_, "/", databases[0], "-", i, ".shards"));
      std::ofstream file(files.back());
      for (size_t shard = 0; shard < kShards; ++shard) {
        proxies_.push_back(std::make_unique<CuttingProxy>(cluster.socket_directory()));
        file << (shard == 0 ? "0-511 " : "512-1023 ")
             << cluster.WriteConninfo(databases[shard], proxies_.back()->directory()) << "\n";
      }
    }
    Begin(files);
  }
  // Two of the servers are far from one database, each from another one: what they find there is
  // older than what they find nearby.
  void PutFarAway(uint64_t seed) {
    for (size_t shard = 0; shard < kShards; ++shard) {
      proxy((seed + shard) % kServers, shard).SetDelay(kFar);
    }
  }
  CuttingProxy& proxy(size_t i, size_t shard) { return *proxies_[i * kShards + shard]; }

  static Calls CallsOf(uint64_t seed) {
    return {.each = 60,
            .seed = seed,
            .hulls = {kHulls[0], kHulls[1]},
            .pairs = true,
            .bodies = {kBodies[0], kBodies[1]},
            .several = true,
            .any_freshness = true};
  }
  static uint64_t NumberIn(const char* variable, uint64_t otherwise) {
    const char* const text = std::getenv(variable);
    return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
  }
  // Few runs unless HULLD_MANY_RUNS says otherwise, each with a seed of its own.
  void ForEachRun(const std::function<void(uint64_t seed)>& run) {
    const uint64_t first = NumberIn("HULLD_TEST_SEED", 0);
    const uint64_t end = first + NumberIn("HULLD_MANY_RUNS", 2);
    for (uint64_t seed = first; seed < end && !HasFailure(); ++seed) run(seed);
  }

  // What the histories hold of what they are to test.
  void Count(const HullHistory& history) {
    for (const auto& [hull_id, operations] : history.operations()) {
      for (const Operation& operation : operations) {
        ++calls_;
        if (operation.outcome != Operation::Outcome::kOk) continue;
        from_the_past_ += operation.staleness > 0;
        of_a_revision_ += operation.at_least_revision > 0;
        puts_ += operation.kind == Operation::Kind::kPut;
        parts_ += operation.kind == Operation::Kind::kVersion || operation.is_part;
        pairs_ += operation.kind == Operation::Kind::kPair;
        batches_ += operation.kind == Operation::Kind::kBatch;
        at_once_ += operation.is_told_with_others;
        const auto elsewhere =
            static_cast<uint64_t>(std::ranges::count_if(operation.others, [&](const Seen& other) {
              return !other.store_id.empty() && other.store_id != operation.store_id;
            }));
        if (operation.kind == Operation::Kind::kBatch) {
          batches_over_two_shards_ += elsewhere > 0;
        }
        if (operation.kind != Operation::Kind::kAsk || operation.is_part) continue;
        ++asked_;
        over_two_shards_ += elsewhere;
      }
    }
  }
  void ExpectAllKinds(uint64_t runs) {
    for (const uint64_t count : {from_the_past_, of_a_revision_, puts_, parts_, pairs_, asked_,
                                 over_two_shards_, batches_, batches_over_two_shards_}) {
      EXPECT_GE(count, runs);
    }
    const auto record = [](const char* name, uint64_t count) {
      RecordProperty(name, std::to_string(count));
    };
    record("calls", calls_);
    record("from_the_past", from_the_past_);
    record("of_a_revision", of_a_revision_);
    record("puts", puts_);
    record("parts", parts_);
    record("pairs", pairs_);
    record("asked", asked_);
    record("over_two_shards", over_two_shards_);
    record("batches", batches_);
    record("batches_over_two_shards", batches_over_two_shards_);
    record("at_once", at_once_);
  }

  std::string directory_;
  // For each server, one proxy for each shard. They outlive the servers of a run.
  std::vector<std::unique_ptr<CuttingProxy>> proxies_;
  uint64_t calls_ = 0;
  uint64_t from_the_past_ = 0;
  uint64_t of_a_revision_ = 0;
  uint64_t puts_ = 0;
  uint64_t parts_ = 0;
  uint64_t pairs_ = 0;
  uint64_t asked_ = 0;
  uint64_t over_two_shards_ = 0;
  uint64_t batches_ = 0;
  uint64_t batches_over_two_shards_ = 0;
  // Acknowledgements of several chunks.
  uint64_t at_once_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_SHARDS_SHARDED_HISTORIES_H_
