#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// Dependencies point one way. Reads the source tree.
namespace hulld {
namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;    // relative to the source tree
  std::string header;  // what stands between the brackets or quotes
};

// The header of an #include line.
std::optional<std::string> HeaderOf(std::string line) {
  std::erase_if(line, [](char c) { return c == ' ' || c == '\t'; });
  constexpr size_t kPrefix = std::string_view("#include").size();
  if (!line.starts_with("#include") || line.size() <= kPrefix) return std::nullopt;
  if (line[kPrefix] != '<' && line[kPrefix] != '"') return std::nullopt;
  const size_t end = line.find_first_of(">\"", kPrefix + 1);
  return line.substr(kPrefix + 1, end - kPrefix - 1);
}

std::vector<Include> IncludesUnder(const std::string& directory) {
  std::vector<Include> result;
  const fs::path root = HULLD_SOURCE_DIR;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / directory)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".cc") continue;
    std::ifstream file(entry.path());
    std::string line;
    while (std::getline(file, line)) {
      const std::optional<std::string> header = HeaderOf(line);
      if (header) result.push_back({fs::relative(entry.path(), root).string(), *header});
    }
  }
  return result;
}

void ExpectNone(const std::string& directory, const std::vector<std::string>& forbidden_prefixes) {
  const std::vector<Include> includes = IncludesUnder(directory);
  EXPECT_FALSE(includes.empty()) << directory << " has no includes: is the source tree there?";
  for (const Include& include : includes) {
    for (const std::string& prefix : forbidden_prefixes) {
      EXPECT_FALSE(include.header.starts_with(prefix))
          << include.file << " includes " << include.header;
    }
  }
}

TEST(Includes, CoreKnowsNoServiceLogOrFile) {
  ExpectNone("core",
             {"server/", "client/", "tests/", "proto/", "hulld/", "grpc", "google/", "spdlog",
              "fmt/", "CLI/", "assimp", "fstream", "iostream", "filesystem", "cstdio", "stdio.h"});
}

TEST(Includes, CorePartsUseOnlyWhatIsBelowThem) {
  ExpectNone("core/numeric", {"core/hull/", "core/query/"});
  ExpectNone("core/hull", {"core/query/"});
}

TEST(Includes, CoreUsesNoOtherLibrary) {
  for (const Include& include : IncludesUnder("core")) {
    const std::string& header = include.header;
    if (header.find('/') == std::string::npos) continue;  // the standard library, or omp.h
    const bool known = header.starts_with("core/") || header.starts_with("Eigen/") ||
                       header.starts_with("boost/multiprecision/") ||
                       header.starts_with("absl/status/") || header.starts_with("absl/strings/");
    EXPECT_TRUE(known) << include.file << " includes " << header;
  }
}

TEST(Includes, ClientKnowsNeitherCoreNorServer) { ExpectNone("client", {"core/", "server/"}); }

TEST(Includes, ServerKnowsNoClient) { ExpectNone("server", {"client/", "tests/"}); }

TEST(Includes, OracleSharesNoCodeWithCore) {
  ExpectNone("tests/oracle", {"core/", "server/", "client/", "tests/core/", "Eigen/"});
}

}  // namespace
}  // namespace hulld
