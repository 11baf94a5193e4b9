#include "client/hullctl/view/browser_picture.h"

#include <absl/strings/escaping.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "client/base/status_macros.h"
#include "client/hullctl/local/local_server.h"

namespace hulld {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBrowsers[] = {"chromium", "chromium-browser", "google-chrome",
                                     "google-chrome-stable", "microsoft-edge"};
constexpr uint32_t kMinSide = 64;
constexpr uint32_t kMaxSide = 16384;

absl::StatusOr<std::string> FindBrowser() {
  if (const char* const chosen = getenv("HULLCTL_BROWSER"); chosen != nullptr) {
    const std::string program = fs::path(chosen).is_absolute() ? chosen : FindProgram(chosen);
    if (!program.empty() && access(program.c_str(), X_OK) == 0) return program;
    return absl::FailedPreconditionError(
        absl::StrCat("HULLCTL_BROWSER names \"", chosen, "\", which is not an executable program"));
  }
  for (const char* const name : kBrowsers) {
    if (std::string program = FindProgram(name); !program.empty()) return program;
  }
  return absl::FailedPreconditionError(
      absl::StrCat("no browser found to draw the picture: none of ", absl::StrJoin(kBrowsers, ", "),
                   " is on the PATH; install one (Debian: chromium), or set HULLCTL_BROWSER"));
}

// Deleted with its content by the destructor.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = TemporaryDirectory() + "/hullctl-picture-XXXXXX";
    if (mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  // Empty if it could not be created.
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// Runs a program to completion, with its output in two files; returns true if it started.
bool RunToEnd(std::vector<std::string> arguments, const std::string& out, const std::string& err) {
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, 0600);
  pid_t child = 0;
  const int failed = posix_spawn(&child, pointers[0], &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return false;
  while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
  return true;
}

std::string BytesOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Returns the last nonblank line.
std::string LastLine(const fs::path& log) {
  std::string last;
  const std::string text = BytesOf(log);
  for (const auto line : absl::StrSplit(text, '\n', absl::SkipWhitespace())) {
    last.assign(line.data(), line.size());
  }
  return last.empty() ? "it printed nothing" : last;
}

}  // namespace

absl::StatusOr<PictureSize> ParsePictureSize(const std::string& text) {
  const std::vector<std::string> sides = absl::StrSplit(text, 'x');
  PictureSize size;
  const auto is_side = [](const std::string& side, uint32_t* pixels) {
    return absl::SimpleAtoi(side, pixels) && *pixels >= kMinSide && *pixels <= kMaxSide;
  };
  if (sides.size() == 2 && is_side(sides[0], &size.width) && is_side(sides[1], &size.height)) {
    return size;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("\"", text, "\" is not a size such as 1600x1000, each side from ", kMinSide,
                   " to ", kMaxSide, " pixels"));
}

absl::StatusOr<std::string> PictureOf(const std::string& picture_page) {
  HULLD_ASSIGN_OR_RETURN(const auto browser, FindBrowser());
  const TemporaryFolder folder;
  const fs::path page = folder.path() / "page.html";
  const fs::path shown = folder.path() / "shown.html";
  const fs::path log = folder.path() / "log";
  if (folder.path().empty() || !(std::ofstream(page, std::ios::binary) << picture_page).flush()) {
    return absl::InternalError(absl::StrCat("cannot write to ", TemporaryDirectory()));
  }
  std::vector<std::string> arguments = {
      browser, "--headless=new", "--no-first-run", "--mute-audio",
      // For machines without a GPU.
      "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
      // The page draws when loaded; its virtual clock then runs to the end.
      "--virtual-time-budget=10000", "--force-prefers-reduced-motion",
      "--force-device-scale-factor=1",
      absl::StrCat("--user-data-dir=", (folder.path() / "profile").string()), "--dump-dom"};
  // The browser's sandbox refuses root. The page is ours and has no network access.
  if (geteuid() == 0) arguments.emplace_back("--no-sandbox");
  arguments.push_back("file://" + page.string());
  const bool started = RunToEnd(std::move(arguments), shown.string(), log.string());
  const std::string text = BytesOf(shown);
  constexpr char kBefore[] = "data-png=\"data:image/png;base64,";
  const size_t before = text.find(kBefore);
  const size_t begin = before + sizeof(kBefore) - 1;
  const size_t end = before == std::string::npos ? before : text.find('"', begin);
  std::string picture;
  if (end != std::string::npos && absl::Base64Unescape(text.substr(begin, end - begin), &picture)) {
    return picture;
  }
  return absl::InternalError(absl::StrCat(
      browser, " produced no picture: ", started ? LastLine(log) : "it could not be started"));
}

}  // namespace hulld
