#include "server/process/heap.h"

#include <malloc.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>

#include "server/settings/cpu_limit.h"

namespace hulld::server {
namespace {

// Free bytes that malloc may keep. A choice: ordinary work leaves fewer.
constexpr size_t kWorthIt = 64 << 20;
// Blocks of at least this size are mapped and unmapped individually. A choice: above the lists of a
// message of some MiB, which double as they grow.
constexpr int kMappedBytes = 8 << 20;
// Bytes that an arena may keep free at its end. A choice: the memory of a call with a message of
// some MiB.
constexpr int kKeptBytes = 32 << 20;

// Returns the resident anonymous memory of this process; 0 if the system does not report it.
size_t AnonymousBytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  size_t total = 0;
  size_t resident = 0;
  size_t of_files = 0;
  const int read = std::fscanf(file, "%zu %zu %zu", &total, &resident, &of_files);
  std::fclose(file);
  if (read != 3) return 0;
  return (resident - of_files) * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

void SetUpHeap() {
  mallopt(M_ARENA_MAX, DefaultThreads());
  mallopt(M_MMAP_THRESHOLD, kMappedBytes);
  mallopt(M_TRIM_THRESHOLD, kKeptBytes);
}

bool GiveBackFreeMemory() {
  const struct mallinfo2 heap = mallinfo2();
  if (AnonymousBytes() < heap.uordblks + heap.hblkhd + kWorthIt) return false;
  malloc_trim(0);
  return true;
}

}  // namespace hulld::server
