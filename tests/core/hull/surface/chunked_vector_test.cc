#include "core/hull/surface/chunked_vector.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace chunked_vector_test {

using Elements = ChunkedVector<int>;

std::vector<int> Contents(const Elements& vector) {
  std::vector<int> contents;
  for (size_t i = 0; i < vector.size(); ++i) contents.push_back(vector[i]);
  return contents;
}

// Applies the same random changes to both.
void Change(Random& random, int changes, Elements& vector, std::vector<int>& expected) {
  for (int i = 0; i < changes; ++i) {
    const int kind = random.Below(8);
    if (kind == 0 && !expected.empty()) {
      vector.pop_back();
      expected.pop_back();
    } else if (kind <= 3 && !expected.empty()) {
      const auto at = static_cast<size_t>(random.Below(static_cast<int>(expected.size())));
      vector.Mutable(at) = expected[at] = i;
    } else {
      vector.push_back(-i);
      expected.push_back(-i);
    }
  }
}

// The sizes pass the growth of the first chunk and the start of further chunks.
TEST(ChunkedVector, UndoRestoresThePreviousContent) {
  const uint64_t seed = TestSeed(601);
  Random random(seed);
  for (const int before : {0, 1, 7, 8, 9, 40, 300, 600, 2000}) {
    for (const int changes : {0, 1, 20, 300, 3000}) {
      Elements vector;
      std::vector<int> expected;
      Change(random, before, vector, expected);
      const std::vector<int> kept = expected;
      vector.StartJournal();
      Change(random, changes, vector, expected);
      EXPECT_EQ(Contents(vector), expected) << before << " " << changes << " seed " << seed;
      vector.Undo();
      EXPECT_EQ(Contents(vector), kept) << before << " " << changes << " seed " << seed;
      // The journal is empty.
      expected = kept;
      vector.StartJournal();
      Change(random, changes, vector, expected);
      vector.EndJournal();
      EXPECT_EQ(Contents(vector), expected) << before << " " << changes << " seed " << seed;
      const Elements copy = vector;
      Change(random, changes, vector, expected);
      EXPECT_EQ(Contents(vector), expected) << before << " " << changes << " seed " << seed;
      EXPECT_LE(copy.size(), vector.size() + static_cast<size_t>(changes));
    }
  }
}

TEST(ChunkedVector, AppendsItsOwnElementWhileGrowing) {
  Elements vector;
  vector.push_back(5);
  for (int i = 0; i < 1000; ++i) vector.push_back(vector[0]);
  EXPECT_EQ(Contents(vector), std::vector<int>(1001, 5));
}

TEST(ChunkedVector, SmallVectorsTakeLittleMemory) {
  Elements vector;
  for (int i = 0; i < 9; ++i) vector.push_back(i);
  EXPECT_LE(vector.MemoryBytes(), 16 * sizeof(int) + 64);
  for (int i = 9; i < 257; ++i) vector.push_back(i);
  EXPECT_GE(vector.MemoryBytes(), 512 * sizeof(int));
}

}  // namespace chunked_vector_test
}  // namespace hulld
