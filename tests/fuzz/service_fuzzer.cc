// libFuzzer on the gRPC surface:
//
//   cmake --preset fuzz && cmake --build --preset fuzz --target service_fuzzer
//   build/fuzz/tests/fuzz/service_fuzzer -max_len=400 -max_total_time=1800 build/fuzz/service

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/fuzz/service_fuzz.h"

namespace {

// The server lives as long as the process; it is never taken down.
hulld::fuzz::ServiceFuzz& Service() {
  static auto* const service = new hulld::fuzz::ServiceFuzz;
  return *service;
}

void PrintReached() {
  for (const auto& [what, count] : Service().reached()) {
    std::fprintf(stderr, "%8d %s\n", count, what.c_str());
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  Service();
  std::atexit(PrintReached);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string finding = Service().Run({data, size});
  if (finding.empty()) return 0;
  std::fprintf(stderr, "%s\n", finding.c_str());
  std::abort();
}
