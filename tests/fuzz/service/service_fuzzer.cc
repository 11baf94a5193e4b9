// libFuzzer on the gRPC API:
//
//   cmake --preset fuzz && cmake --build --preset fuzz --target service_fuzzer
//   build/fuzz/bin/service_fuzzer -max_len=400 -max_total_time=1800 build/fuzz/service

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/fuzz/service/service_fuzz.h"

namespace {

// The servers live until the process ends and are never shut down.
hulld::fuzz::ServiceFuzz& Service(bool durable) {
  static auto* const memory = new hulld::fuzz::ServiceFuzz("memory");
  static auto* const rocksdb = new hulld::fuzz::ServiceFuzz("rocksdb");
  return durable ? *rocksdb : *memory;
}

void PrintReached() {
  for (const bool durable : {false, true}) {
    for (const auto& [what, count] : Service(durable).reached()) {
      std::fprintf(stderr, "%8d %s%s\n", count, what.c_str(), durable ? ", durable" : "");
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  Service(false);
  std::atexit(PrintReached);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  // The first byte selects the store for the rest.
  const bool durable = size > 0 && data[0] % 4 == 0;
  const size_t start = size > 0 ? 1 : 0;
  const std::string finding = Service(durable).Run({data + start, size - start});
  if (finding.empty()) return 0;
  std::fprintf(stderr, "%s\n", finding.c_str());
  std::abort();
}
