// libFuzzer on the coordinates of hulls:
//
//   cmake --preset fuzz && cmake --build --preset fuzz --target hull_fuzzer
//   build/fuzz/bin/hull_fuzzer -max_len=512 -max_total_time=1800 build/fuzz/corpus

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/hulls/fuzz_cloud.h"
#include "tests/fuzz/hulls/hull_check.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const hulld::fuzz::FuzzCloud cloud = hulld::fuzz::DecodeFuzzCloud({data, size});
  const hulld::fuzz::Verdict verdict = hulld::fuzz::CheckHullOf(cloud);
  if (verdict.finding.empty()) return 0;
  std::fprintf(stderr, "%s\n", verdict.finding.c_str());
  for (const hulld::Vector& p : cloud.points) {
    std::fprintf(stderr, "{%a, %a, %a},\n", p.x(), p.y(), p.z());
  }
  std::abort();
}
