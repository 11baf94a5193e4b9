// hulld with a defect in how it reads bodies and hulls of several shards, or several at once.
// Histories must find it.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/server/shards/sharded_histories.h"

namespace hulld::server {
namespace {

class ShardedMutants : public ShardedHistories {
 protected:
  // In the test of its name, mutants/NAME.patch. Found after ten histories at most when this was
  // written.
  void ExpectFound() {
    constexpr uint64_t kMost = 60;
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    UseProgram(HULLD_MUTANTS "/" + name + "/hulld");
    for (uint64_t seed = 0; seed < kMost && !HasFailure(); ++seed) {
      BeginBehindProxies();
      PutFarAway(seed);
      HullHistory history;
      Run(CallsOf(7000 + seed), {}, history);
      if (!HistoryFault(history).empty()) return;
    }
    ADD_FAILURE() << name << " was not found";
  }
};

TEST_F(ShardedMutants, ABatchLooksUpOneHullByItself) { ExpectFound(); }

TEST_F(ShardedMutants, ABodyMayChangeWhileItsPiecesAreRead) { ExpectFound(); }

TEST_F(ShardedMutants, AListEndsWithAFullPage) { ExpectFound(); }

TEST_F(ShardedMutants, AStreamKeepsAnswersAboutHullsThatChanged) { ExpectFound(); }

TEST_F(ShardedMutants, OneShardAloneIsFresh) { ExpectFound(); }

TEST_F(ShardedMutants, TheShardOfABodyIsNotAsked) { ExpectFound(); }

}  // namespace
}  // namespace hulld::server
