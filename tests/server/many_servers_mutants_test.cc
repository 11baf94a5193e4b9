// Runs hulld with a defect in how it reads bodies or several hulls. Histories of many servers must
// detect it.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/server/harness/postgres/many_servers.h"

namespace hulld::server {
namespace many_servers_mutants_test {

class ManyServersMutants : public ManyServersTest {
 protected:
  // Requires mutants/NAME.patch for the test of this name.
  void ExpectFound() {
    constexpr uint64_t kMax = 60;
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    UseProgram(HULLD_MUTANTS "/" + name + "/hulld");
    for (uint64_t seed = 0; seed < kMax && !HasFailure(); ++seed) {
      Begin();
      HullHistory history;
      Run({.each = 60,
           .seed = 7000 + seed,
           .pairs = true,
           .bodies = {"body/a", "body/b"},
           .several = true,
           .any_freshness = true},
          {}, history);
      if (!HistoryFault(history).empty()) return;
    }
    ADD_FAILURE() << name << " was not found";
  }
};

TEST_F(ManyServersMutants, FirstHullIsLookedUpSeparately) { ExpectFound(); }

TEST_F(ManyServersMutants, BodyIsReplacedDuringPieceLookup) { ExpectFound(); }

TEST_F(ManyServersMutants, StreamKeepsStaleAnswers) { ExpectFound(); }

}  // namespace many_servers_mutants_test
}  // namespace hulld::server
