#include "server/process/heap.h"

#include <malloc.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>

#include "server/settings/resource_limits.h"

namespace hulld::server {
namespace {

// Free bytes that malloc may keep: more than ordinary work leaves free. Not tuned.
constexpr size_t kMinReleasedBytes = 64 << 20;
// Blocks of at least this size are mapped and unmapped individually. Above the size of the lists of
// a message of a few MiB, which double as they grow. Not tuned.
constexpr int kMappedBytes = 8 << 20;
// Bytes that an arena may keep free at its end: the memory of a call with a message of a few MiB.
// Not tuned.
constexpr int kKeptBytes = 32 << 20;

}  // namespace

void SetUpHeap() {
  mallopt(M_ARENA_MAX, DefaultThreads());
  mallopt(M_MMAP_THRESHOLD, kMappedBytes);
  mallopt(M_TRIM_THRESHOLD, kKeptBytes);
}

ResidentMemory ReadResidentMemory() {
  std::ifstream file("/proc/self/statm");
  size_t total = 0;
  size_t resident = 0;
  size_t of_files = 0;
  if (!(file >> total >> resident >> of_files)) return {};
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  return {resident * page, (resident - of_files) * page};
}

bool ReleaseFreeMemory() {
  const struct mallinfo2 heap = mallinfo2();
  if (ReadResidentMemory().anonymous_bytes < heap.uordblks + heap.hblkhd + kMinReleasedBytes)
    return false;
  malloc_trim(0);
  return true;
}

}  // namespace hulld::server
