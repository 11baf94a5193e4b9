#include "tests/fuzz/service/service_fuzz.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/contract/rpc.h"
#include "tests/core/checks/point_sets.h"
#include "tests/test_size.h"

namespace hulld::fuzz {
namespace service_fuzz_test {

// Runs the fuzz target without the fuzzer: a fixed number of programs from a fixed seed.
constexpr int kPrograms = TestSize(1000, 200);

std::vector<uint8_t> RandomProgram(Random& random) {
  std::vector<uint8_t> bytes(static_cast<size_t>(random.Between(1, 500)));
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random.Below(256));
  return bytes;
}

// A case that must be reached at least this many times.
struct Goal {
  const char* what;
  int times;
};

constexpr Goal kGoals[] = {
    {"CreateHull OK", 5},
    {"CreateHull INVALID_ARGUMENT", 5},
    {"CreateHull ALREADY_EXISTS", 5},
    {"AppendPoints OK", 20},
    {"AppendPoints INVALID_ARGUMENT", 20},
    {"AppendPoints NOT_FOUND", 1},
    {"AppendPoints FAILED_PRECONDITION", 1},
    {"AppendPoints ABORTED", 2},
    {"AppendPoints CANCELLED", 5},
    {"AppendPoints opened", 20},
    {"ReplaceHull OK", 40},
    {"ReplaceHull replaced", 40},
    {"ReplaceHull created", 1},
    {"ReplaceHull cut short", 40},
    {"ReplaceHull INVALID_ARGUMENT", 100},
    {"ReplaceHull NOT_FOUND", 2},
    {"ReplaceHull ABORTED", 1},
    {"ReplaceHull CANCELLED", 5},
    {"GetHull OK", 10},
    {"GetHull NOT_FOUND", 2},
    {"GetHull INVALID_ARGUMENT", 5},
    {"GetHullMesh OK", 10},
    {"GetHullMesh INVALID_ARGUMENT", 5},
    {"GetHullMesh not read", 1},
    {"ListHulls OK", 10},
    {"ListHulls INVALID_ARGUMENT", 5},
    {"DeleteHull OK", 5},
    {"DeleteHull INVALID_ARGUMENT", 5},
    {"DeleteHull ABORTED", 1},
    {"CheckCollision OK", 10},
    {"CheckCollision NOT_FOUND", 1},
    {"CheckCollision INVALID_ARGUMENT", 10},
    {"RELATION_SEPARATED", 3},
    {"RELATION_TOUCHING", 1},
    {"RELATION_OVERLAPPING", 3},
    {"certificate", 10},
    {"BatchCheckCollisions OK", 10},
    {"BatchCheckCollisions with pairs", 10},
    {"BatchCheckCollisions compared with packed placements", 3},
    {"BatchCheckCollisions INVALID_ARGUMENT", 10},
    {"BatchCheckCollisions not read", 1},
    {"StreamCollisions OK", 10},
    {"StreamCollisions INVALID_ARGUMENT", 10},
    {"StreamCollisions CANCELLED", 3},
    {"StreamCollisions compared", 5},
    {"StreamCollisions compared after updates", 5},
    {"FindCollisions OK", 10},
    {"FindCollisions INVALID_ARGUMENT", 5},
    {"FindCollisions compared", 3},
    {"PutBody OK", 50},
    {"PutBody INVALID_ARGUMENT", 20},
    {"PutBody ALREADY_EXISTS", 2},
    {"GetBody compared", 5},
    {"ListBodies OK", 3},
    {"DeleteBody OK", 5},
    {"body compared RELATION_SEPARATED", 10},
    {"body compared RELATION_TOUCHING", 10},
    {"body compared RELATION_OVERLAPPING", 10},
    {"WatchHulls reported", 20},
    {"WatchHulls change", 2},
    {"WatchHulls resumed", 10},
    {"WatchHulls INVALID_ARGUMENT", 20},
    {"WatchCollisions OK", 10},
    {"WatchCollisions INVALID_ARGUMENT", 10},
    {"WatchCollisions CANCELLED", 1},
    {"WatchCollisions collision", 3},
    {"WatchCollisions RELATION_TOUCHING", 2},
    {"WatchCollisions compared", 3},
    {"WatchCollisions compared after updates", 5},
    {"GetStatus OK", 3},
    {"SaveBackup OK", 3},
    {"SaveBackup FAILED_PRECONDITION", 8},
    {"malformed message", 20},
    {"all hulls as acknowledged", 150},
    {"most hulls as acknowledged", 30},
    {"store opened again", 6},
    {"backup opened", 6},
    {"--max-points-per-chunk", 1},
    {"--max-vertices-per-hull", 1},
    {"--max-hulls", 1},
    {"--max-pieces-per-body", 2},
    {"--max-pairs-per-batch", 1},
    {"--max-textbook-axes", 1},
};

TEST(ServiceFuzz, RandomProgramsOfCallsPassEveryCheck) {
  const uint64_t seed = TestSeed(603);
  Random random(seed);
  ServiceFuzz memory("memory");
  ServiceFuzz durable("rocksdb");
  for (int i = 0; i < kPrograms; ++i) {
    const std::vector<uint8_t> program = RandomProgram(random);
    ASSERT_EQ((i % 4 == 0 ? durable : memory).Run(program), "")
        << "seed " << seed << " program " << i << " " << testing::PrintToString(program);
  }
  std::map<std::string, int> reached_in_all = memory.reached();
  for (const auto& [what, times] : durable.reached()) reached_in_all[what] += times;
  // The programs cover the intended cases.
  for (const Goal& goal : kGoals) {
    const auto reached = reached_in_all.find(goal.what);
    EXPECT_GE(reached == reached_in_all.end() ? 0 : reached->second,
              TestSize(goal.times, goal.times / 10))
        << goal.what;
  }
  for (const auto& [what, times] : reached_in_all) RecordProperty(what, times);
}

}  // namespace service_fuzz_test
}  // namespace hulld::fuzz
