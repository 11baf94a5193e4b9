#include "server/process/heap.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <memory>
#include <vector>

namespace hulld::server {
namespace heap_test {

#ifdef HULLD_SANITIZED
// Sanitizers' allocators retain freed memory to detect its use.
TEST(Heap, DISABLED_OnlyLargeAmountsOfFreeMemoryAreReturned) {
#else
TEST(Heap, OnlyLargeAmountsOfFreeMemoryAreReturned) {
#endif
  ReleaseFreeMemory();
  constexpr size_t kBlock = 8 << 10;
  constexpr size_t kBlocks = 20'000;
  std::vector<std::unique_ptr<char[]>> blocks(kBlocks);
  for (auto& block : blocks) {
    block = std::make_unique<char[]>(kBlock);
    std::memset(block.get(), 1, kBlock);
  }
  EXPECT_FALSE(ReleaseFreeMemory());
  // The last block keeps all earlier ones from being returned automatically.
  for (size_t i = 0; i + 1 < kBlocks; ++i) blocks[i] = nullptr;
  EXPECT_TRUE(ReleaseFreeMemory());
  EXPECT_FALSE(ReleaseFreeMemory());
}

}  // namespace heap_test
}  // namespace hulld::server
