// The registry with a past or possible defect (mutants/). Schedules that find it demonstrate that
// they cover the right places.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "tests/server/schedules/explorer.h"

namespace hulld::server {
namespace mutant_test {

constexpr uint64_t kMax = 300'000;
// **Observed**: the rarest defect, ListIsAheadOfRegistry, is found within the first 33,235
// schedules.
constexpr uint64_t kFirstSeed = 1'000'001;

// Explores in a separate process, because a defect may break an invariant. Returns its exit status.
int ExploreElsewhere() {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    Reached reached;
    const auto found = Explore(NumberIn("HULLD_TEST_SEED", kFirstSeed), kMax, reached);
    if (!found.has_value()) _exit(0);
    std::fputs(Report(*found).c_str(), stderr);
    _exit(1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

TEST(Mutant, IsFound) {
  const int status = ExploreElsewhere();
  const bool is_reported = WIFEXITED(status) && WEXITSTATUS(status) == 1;
  const bool is_broken = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
  EXPECT_TRUE(is_reported || is_broken) << "not found by " << kMax << " schedules: " << status;
}

}  // namespace mutant_test
}  // namespace hulld::server
