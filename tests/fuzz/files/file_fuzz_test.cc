#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/core/checks/point_sets.h"
#include "tests/fuzz/files/file_check.h"
#include "tests/fuzz/files/file_mutation.h"
#include "tests/fuzz/files/file_seeds.h"
#include "tests/test_size.h"

namespace hulld::fuzz {
namespace file_fuzz_test {

// Runs the fuzz target without the fuzzer: a fixed number of inputs from a fixed seed.
constexpr int kChangesPerSeed = TestSize(1500, 300);

// HULLD_FUZZ_CHANGES sets another number, for long runs by hand.
int ChangesPerSeed() {
  const char* const text = std::getenv("HULLD_FUZZ_CHANGES");
  return text == nullptr ? kChangesPerSeed : std::atoi(text);
}

size_t Place(Random& random, const std::string& content) {
  return static_cast<size_t>(random.Below(static_cast<int>(content.size()) + 1));
}

void Change(Random& random, std::string* content) {
  const size_t at = Place(random, *content);
  switch (random.Below(5)) {
    case 0:
      if (at < content->size()) (*content)[at] = static_cast<char>(random.Below(256));
      return;
    case 1:
      content->erase(at, static_cast<size_t>(random.Below(9)));
      return;
    case 2:
      content->resize(at);
      return;
    case 3:
      content->insert(at, content->substr(Place(random, *content), 12));
      return;
    default: {
      const std::vector<std::string>& tokens = FileTokens();
      content->insert(at,
                      tokens[static_cast<size_t>(random.Below(static_cast<int>(tokens.size())))]);
    }
  }
}

TEST(FileFuzz, SeedsAreAccepted) {
  for (const SeedFile& seed : SeedFiles()) {
    // One seed has a point that only --skip-nonfinite accepts.
    if (seed.content.find("nan nan") != std::string::npos) continue;
    const FileVerdict verdict = CheckFile(seed.kind, seed.content);
    EXPECT_EQ(verdict.finding, "") << seed.content;
    EXPECT_TRUE(verdict.read) << seed.content;
  }
}

TEST(FileFuzz, MutatedFilesAreReadOrRefused) {
  const uint64_t seed = TestSeed(701);
  Random random(seed);
  const auto next = [&random](size_t n) {
    return static_cast<size_t>(random.Below(static_cast<int>(n)));
  };
  std::array<int, kFileKinds> read = {};
  std::array<int, kFileKinds> refused = {};
  for (const SeedFile& file : SeedFiles()) {
    for (int i = 0; i < ChangesPerSeed(); ++i) {
      std::string content = file.content;
      for (int changes = random.Between(1, 4); changes > 0; --changes) {
        if (random.Below(2) == 0) {
          Change(random, &content);
        } else {
          ChangeStructure(next, &content);
        }
      }
      const FileVerdict verdict = CheckFile(file.kind, content);
      ASSERT_EQ(verdict.finding, "")
          << "seed " << seed << " kind " << static_cast<int>(file.kind) << ":\n"
          << testing::PrintToString(content);
      ++(verdict.read ? read : refused)[static_cast<size_t>(file.kind)];
    }
  }
  for (size_t kind = 0; kind < kFileKinds; ++kind) {
    // Few mutations leave JSON unchanged.
    EXPECT_GT(read[kind], kChangesPerSeed / 300) << kind;
    EXPECT_GT(refused[kind], kChangesPerSeed / 5) << kind;
  }
}

}  // namespace file_fuzz_test
}  // namespace hulld::fuzz
