#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/source_tree.h"

// Reads the source tree and checks that dependencies point one way and that comments are plain.
namespace hulld {
namespace tree_test {

namespace fs = std::filesystem;

struct Include {
  std::string file;    // relative to the source tree
  std::string header;  // the text between brackets or quotes
};

// Returns the header of an #include line.
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
  const fs::path root = SourceTree();
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
  EXPECT_FALSE(includes.empty()) << directory << " has no includes; does the source tree exist?";
  for (const Include& include : includes) {
    for (const std::string& prefix : forbidden_prefixes) {
      EXPECT_FALSE(include.header.starts_with(prefix))
          << include.file << " includes " << include.header;
    }
  }
}

TEST(Includes, CoreUsesNoServiceLogOrFile) {
  ExpectNone("core",
             {"server/", "client/", "tests/", "proto/", "hulld/", "grpc", "google/", "spdlog",
              "fmt/", "CLI/", "pugixml", "fstream", "iostream", "filesystem", "cstdio", "stdio.h"});
}

// For each folder, the other folders whose headers it includes, with one such include.
using Arrows = std::map<std::string, std::map<std::string, Include>>;

Arrows ArrowsBetweenFolders() {
  Arrows arrows;
  for (const std::string top : {"core", "server", "client"}) {
    for (const Include& include : IncludesUnder(top)) {
      const std::string from = fs::path(include.file).parent_path().string();
      const std::string to = fs::path(include.header).parent_path().string();
      const bool is_folder = fs::is_directory(SourceTree() / to);
      if (!to.empty() && is_folder && from != to) arrows[from].emplace(to, include);
    }
  }
  return arrows;
}

// The build shows a target only the headers of the targets that it names, but the folders of a
// target see each other. Parent folders are no exception.
TEST(Includes, FoldersDependOnEachOtherInOneDirection) {
  Arrows arrows = ArrowsBetweenFolders();
  EXPECT_GT(arrows.size(), 50);
  const auto is_lowest = [&arrows](const auto& folder) {
    return std::none_of(folder.second.begin(), folder.second.end(),
                        [&](const auto& arrow) { return arrows.count(arrow.first) > 0; });
  };
  while (std::erase_if(arrows, is_lowest) > 0) {
  }
  for (const auto& [from, to_each] : arrows) {
    for (const auto& [to, include] : to_each) {
      if (arrows.count(to) == 0) continue;
      ADD_FAILURE() << include.file << " includes " << include.header
                    << ", in a cycle of folders or above one";
    }
  }
}

TEST(Includes, NoFolderIsCrowded) {
  constexpr int kMaxFiles = 24;
  const fs::path root = SourceTree();
  for (const std::string top : {"core", "server", "client", "tests", "proto", "docker"}) {
    std::map<std::string, int> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / top)) {
      if (!entry.is_regular_file()) continue;
      ++files[fs::relative(entry.path().parent_path(), root).string()];
    }
    for (const auto& [folder, count] : files) EXPECT_LE(count, kMaxFiles) << folder;
  }
}

// Returns the folders of source files by name without extension; tests are named after sources.
std::multimap<std::string, std::string> FoldersOfSources() {
  std::set<std::string> seen;
  std::multimap<std::string, std::string> folders;
  const fs::path root = SourceTree();
  for (const std::string top : {"core", "server", "client"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cc") continue;
      const std::string folder = fs::relative(entry.path().parent_path(), root).string();
      const bool is_new = seen.insert(folder + "/" + entry.path().stem().string()).second;
      if (is_new) folders.emplace(entry.path().stem().string(), folder);
    }
  }
  return folders;
}

TEST(Tests, MirrorTheSourceTree) {
  const std::multimap<std::string, std::string> folders = FoldersOfSources();
  const fs::path root = SourceTree() / "tests";
  constexpr std::string_view kEnd = "_test";
  int checked = 0;
  for (const std::string top : {"core", "server", "client"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / top)) {
      std::string name = entry.path().stem().string();
      if (entry.path().extension() != ".cc" || !name.ends_with(kEnd)) continue;
      name.resize(name.size() - kEnd.size());
      const auto [first, last] = folders.equal_range(name);
      if (first == last) continue;  // named for the behavior it shows
      const std::string folder = fs::relative(entry.path().parent_path(), root).string();
      EXPECT_TRUE(std::any_of(first, last, [&](const auto& each) { return each.second == folder; }))
          << "tests/" << folder << "/" << name << "_test.cc: the source is in " << first->second;
      ++checked;
    }
  }
  EXPECT_GT(checked, 50);
}

// A call of hulld_add_test in a CMakeLists.txt, split into words.
struct TestProgram {
  fs::path folder;
  std::vector<std::string> words;

  const std::string& name() const { return words.front(); }
  bool Has(const std::string& word) const {
    return std::find(words.begin(), words.end(), word) != words.end();
  }
};

std::vector<TestProgram> TestPrograms() {
  std::vector<TestProgram> programs;
  const fs::path tests = SourceTree() / "tests";
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(tests)) {
    if (entry.path().filename() != "CMakeLists.txt") continue;
    std::ifstream file(entry.path());
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::string call = "\nhulld_add_test(";
    for (size_t at = ("\n" + text).find(call); at != std::string::npos;) {
      // The text lacks the first line break, hence the difference of one.
      const size_t begin = at + call.size() - 1;
      const size_t end = text.find(')', begin);
      std::istringstream words(text.substr(begin, end - begin));
      programs.push_back(
          {entry.path().parent_path(), {std::istream_iterator<std::string>(words), {}}});
      at = ("\n" + text).find(call, end);
    }
  }
  return programs;
}

// Returns true if a test source starts threads: directly, by a team of core, or by a header that it
// includes.
bool RunsThreads(const fs::path& source) {
  constexpr std::string_view kHeaders[] = {
      "atomic",
      "future",
      "thread",
      "core/query/batch.h",
      "core/query/scene/scene.h",
      "tests/server/harness/kept_store.h",
      "tests/server/harness/store_fixture.h",
      "tests/server/store/postgres/postgres_fixture.h",
  };
  std::ifstream file(source);
  for (std::string line; std::getline(file, line);) {
    const std::optional<std::string> header = HeaderOf(line);
    if (!header.has_value()) continue;
    if (std::find(std::begin(kHeaders), std::end(kHeaders), *header) != std::end(kHeaders)) {
      return true;
    }
  }
  return false;
}

// ThreadSanitizer covers every test program that runs threads and can be instrumented.
TEST(Programs, WithThreadsAreInThePresetTsan) {
  // gRPC is not instrumented.
  const std::string grpc[] = {"hulld_test_server", "hulld_client", "hulld_fake", "hulld_history",
                              "hullctl_commands"};
  int marked = 0;
  for (const TestProgram& program : TestPrograms()) {
    const std::string folder = program.folder.string();
    // File readers run on one thread for any input.
    if (folder.find("/tests/client") != std::string::npos) continue;
    const bool uses_grpc = std::any_of(std::begin(grpc), std::end(grpc),
                                       [&](const auto& library) { return program.Has(library); });
    const bool runs_threads =
        std::any_of(program.words.begin(), program.words.end(), [&](const std::string& word) {
          return word.ends_with(".cc") && RunsThreads(program.folder / word);
        });
    EXPECT_EQ(program.Has("THREADS"), runs_threads && !uses_grpc) << program.name();
    marked += program.Has("THREADS") ? 1 : 0;
  }
  EXPECT_GE(marked, 5);
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

TEST(Includes, ClientIncludesNeitherCoreNorServer) { ExpectNone("client", {"core/", "server/"}); }

TEST(Includes, ServerDoesNotIncludeClient) { ExpectNone("server", {"client/", "tests/"}); }

TEST(Includes, OracleSharesNoCodeWithCore) {
  ExpectNone("tests/oracle", {"core/", "server/", "client/", "tests/core/", "Eigen/"});
}

}  // namespace tree_test
}  // namespace hulld
