#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

// Dependencies point one way. Reads the source tree.
namespace hulld {
namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;    // relative to the source tree
  std::string header;  // what stands between the brackets or quotes
};

std::vector<Include> IncludesUnder(const std::string& directory) {
  std::vector<Include> result;
  const fs::path root = HULLD_SOURCE_DIR;
  const std::regex pattern(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / directory)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".cc") continue;
    std::ifstream file(entry.path());
    std::string line;
    std::smatch match;
    while (std::getline(file, line)) {
      if (std::regex_search(line, match, pattern)) {
        result.push_back({fs::relative(entry.path(), root).string(), match[1]});
      }
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
