// Measures the memory of many small hulls in the registry, and the time to look up each of them.
//
//   many_hulls_benchmark [--hulls N] [DIRECTORY]
//
// Creates N boxes (default 100000), in memory or in a RocksDB store in a new DIRECTORY, and queries
// them. A query resolves all hulls in one call, like a batch that names each hull once. The step
// `idle` does what the server does every ten seconds.
//
// Prints a CSV row after each step: the heap and the bytes that count against --memory-limit, each
// per hull; the processor time of this process per hull; and the resident memory.

#include <malloc.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/store/memory_store.h"
#include "server/store/rocksdb_store.h"

namespace hulld::server {
namespace {

double ProcessorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double ResidentMegabytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  size_t total = 0;
  size_t resident = 0;
  const bool is_read = file != nullptr && std::fscanf(file, "%zu %zu", &total, &resident) == 2;
  if (file != nullptr) std::fclose(file);
  return is_read ? 1e-6 * static_cast<double>(resident * static_cast<size_t>(sysconf(_SC_PAGESIZE)))
                 : 0;
}

std::vector<Vector> Box(int i) {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k) {
    corners.emplace_back(2. * (i % 100) + (k & 1), 2. * (i / 100 % 100) + (k >> 1 & 1),
                         2. * (i / 10000) + (k >> 2));
  }
  return corners;
}

class ManyHulls {
 public:
  ManyHulls(Store& store, int hulls) : registry_(store, WideLimits(), writers_) {
    if (!registry_.Load().ok()) std::abort();
    for (int i = 0; i < hulls; ++i) {
      char id[16];
      std::snprintf(id, sizeof id, "box/%08d", i);
      ids_.emplace_back(id);
    }
    std::printf("step,heap bytes per hull,counted bytes per hull,us per hull,resident MB\n");
    heap_before_ = Heap();
  }

  void Create() {
    const double start = ProcessorSeconds();
    for (size_t i = 0; i < ids_.size(); ++i) {
      Replacement replacement;
      replacement.hull_id = ids_[i];
      replacement.create_if_absent = true;
      replacement.builder = std::make_shared<HullBuilder>();
      replacement.counts = *replacement.builder->Add(Box(static_cast<int>(i)));
      std::promise<bool> created;
      registry_.changes().Replace(
          std::move(replacement),
          [&](const absl::StatusOr<PutHullResult>& result) { created.set_value(result.ok()); });
      if (!created.get_future().get()) std::abort();
    }
    Print("create", start);
  }
  void Query(const char* step) {
    const double start = ProcessorSeconds();
    {
      const absl::StatusOr<Resolved> resolved = registry_.Resolve(ids_, {});
      if (!resolved.ok() || !resolved->hulls.back().ok()) std::abort();
    }
    Print(step, start);
  }
  void Idle(const char* step) {
    const double start = ProcessorSeconds();
    registry_.RestIdleHulls();
    Print(step, start);
  }
  void Append() {
    const double start = ProcessorSeconds();
    for (const std::string& id : ids_) {
      std::promise<absl::StatusOr<OpenResult>> opened;
      registry_.changes().OpenAppend(
          id, "writer", false, [](const absl::Status&) {},
          [&](absl::StatusOr<OpenResult> result) { opened.set_value(std::move(result)); });
      const absl::StatusOr<OpenResult> open = opened.get_future().get();
      std::promise<bool> added;
      registry_.changes().Append(
          open->session, {1, {{1e6, 0, 0}}, std::nullopt}, {}, {},
          [&](const absl::StatusOr<ChunkResult>& result) { added.set_value(result.ok()); });
      if (!added.get_future().get()) std::abort();
      registry_.changes().CloseAppend(open->session);
    }
    Print("append", start);
  }

 private:
  static Limits WideLimits() {
    Limits limits;
    limits.memory_limit = uint64_t{16} << 30;
    limits.max_hulls = uint64_t{1} << 32;
    return limits;
  }
  static double Heap() {
    const struct mallinfo2 heap = mallinfo2();
    return static_cast<double>(heap.uordblks + heap.hblkhd);
  }
  void Print(const char* step, double start) {
    const auto hulls = static_cast<double>(ids_.size());
    const double seconds = ProcessorSeconds() - start;
    malloc_trim(0);
    std::printf("%s,%.0f,%.0f,%.2f,%.0f\n", step, (Heap() - heap_before_) / hulls,
                static_cast<double>(registry_.Cache().bytes) / hulls, 1e6 * seconds / hulls,
                ResidentMegabytes());
    std::fflush(stdout);
  }

  TaskPool writers_{2};
  Registry registry_;
  std::vector<std::string> ids_;
  double heap_before_ = 0;
};

int Run(Store& store, int hulls) {
  ManyHulls many(store, hulls);
  many.Create();
  many.Query("first query");
  many.Query("second query");
  many.Query("third query");
  many.Idle("idle once");
  many.Idle("idle");
  many.Query("query after idle");
  many.Idle("idle once");
  many.Idle("idle");
  many.Append();
  many.Idle("idle once");
  many.Idle("idle");
  return 0;
}

}  // namespace
}  // namespace hulld::server

int main(int argc, char** argv) {
  int hulls = 100000;
  int next = 1;
  if (argc > 2 && std::strcmp(argv[1], "--hulls") == 0) {
    hulls = std::atoi(argv[2]);
    next = 3;
  }
  if (next == argc) {
    hulld::server::MemoryStore store;
    return hulld::server::Run(store, hulls);
  }
  hulld::server::RocksDbOptions options;
  options.data_dir = argv[next];
  options.durability = hulld::server::Durability::kRelaxed;
  auto store = hulld::server::RocksDbStore::Open(options);
  if (!store.ok()) {
    std::fprintf(stderr, "many_hulls_benchmark: %s\n",
                 std::string(store.status().message()).c_str());
    return 1;
  }
  return hulld::server::Run(**store, hulls);
}
