// libFuzzer on the file readers. The first byte of an input selects the kind, the rest is the file.
// It writes its own seeds:
//
//   cmake --preset fuzz && cmake --build --preset fuzz --target file_fuzzer
//   build/fuzz/bin/file_fuzzer --write_seeds=build/fuzz/files -runs=0
//   build/fuzz/bin/file_fuzzer -max_len=4096 -malloc_limit_mb=128 -max_total_time=1800
//       build/fuzz/files

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/fuzz/files/file_check.h"
#include "tests/fuzz/files/file_mutation.h"
#include "tests/fuzz/files/file_seeds.h"

namespace {

using hulld::fuzz::FileKind;
using hulld::fuzz::kFileKinds;

void WriteSeeds(const std::string& directory) {
  std::filesystem::create_directories(directory);
  int number = 0;
  for (const hulld::fuzz::SeedFile& seed : hulld::fuzz::SeedFiles()) {
    std::ofstream file(directory + "/seed-" + std::to_string(number++), std::ios::binary);
    file << static_cast<char>(seed.kind) << seed.content;
  }
}

}  // namespace

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kFlag = "--write_seeds=";
  for (int i = 1; i < *argc; ++i) {
    const std::string argument = (*argv)[i];
    if (argument.rfind(kFlag, 0) == 0) WriteSeeds(argument.substr(kFlag.size()));
  }
  return 0;
}

// Sometimes inserts a token of the formats.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  const std::string& token = hulld::fuzz::FileTokens()[seed / 4 % hulld::fuzz::FileTokens().size()];
  if (seed % 4 != 0 || size == 0 || size + token.size() > max_size) {
    return LLVMFuzzerMutate(data, size, max_size);
  }
  const size_t at = 1 + seed / 256 % size;
  std::memmove(data + at + token.size(), data + at, size - at);
  std::memcpy(data + at, token.data(), token.size());
  return size + token.size();
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const auto kind = static_cast<FileKind>(data[0] % kFileKinds);
  const std::string_view content(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string finding = hulld::fuzz::CheckFile(kind, content).finding;
  if (finding.empty()) return 0;
  std::fprintf(stderr, "%s\n", finding.c_str());
  std::abort();
}
