#ifndef HULLD_TESTS_FUZZ_FILES_FILE_SEEDS_H_
#define HULLD_TESTS_FUZZ_FILES_FILE_SEEDS_H_

#include <string>
#include <vector>

#include "tests/fuzz/files/file_check.h"

namespace hulld::fuzz {

// A small file of each kind, with variants if the kind has several.
struct SeedFile {
  FileKind kind;
  std::string content;
};
std::vector<SeedFile> SeedFiles();

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_FILES_FILE_SEEDS_H_
