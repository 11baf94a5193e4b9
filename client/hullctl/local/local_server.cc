#include "client/hullctl/local/local_server.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <utility>
#include <vector>

#include "client/base/status_macros.h"

namespace hulld {
namespace {

namespace fs = std::filesystem;

// Its input is a pipe from hullctl, which the kernel closes when hullctl ends. $0: the folder.
constexpr char kKeeper[] = R"(exec 3<&0
"$@" 3<&- </dev/null & child=$!
{ read -r _ <&3; kill "$child" 2>/dev/null; } & reader=$!
wait "$child"
kill "$reader" 2>/dev/null
rm -f "$0/socket"; rmdir "$0" 2>/dev/null
)";
constexpr char kListening[] = "listening on ";

bool IsProgram(const fs::path& path) { return access(path.c_str(), X_OK) == 0; }

absl::StatusOr<std::string> FindServer() {
  if (const char* const named = std::getenv("HULLD_BINARY"); named != nullptr) {
    if (IsProgram(named)) return named;
    return absl::NotFoundError(
        absl::StrCat("HULLD_BINARY is ", named, ", which is not an executable program"));
  }
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  if (IsProgram(folder / "hulld")) return (folder / "hulld").string();
  if (std::string found = FindProgram("hulld"); !found.empty()) return found;
  return absl::NotFoundError(
      "hulld is neither next to hullctl nor on the PATH; install it, or set HULLD_BINARY");
}

// The environment without hulld's settings, which are not meant for this server.
std::vector<char*> EnvironmentWithoutSettings() {
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (!std::string_view(*variable).starts_with("HULLD_")) variables.push_back(*variable);
  }
  variables.push_back(nullptr);
  return variables;
}

// Reads a log to its end. Sets `start` to the line with the address of the server or, failing that,
// to the last line.
void ReadLog(int log, std::promise<std::pair<bool, std::string>> start) {
  FILE* const lines = fdopen(log, "r");
  char* line = nullptr;
  size_t capacity = 0;
  std::string last = "it logged nothing";
  bool has_started = false;
  while (getline(&line, &capacity, lines) > 0) {
    if (has_started) continue;
    last = line;
    if (last.ends_with('\n')) last.pop_back();
    const size_t found = last.find(kListening);
    has_started = found != std::string::npos;
    if (has_started) start.set_value({true, last.substr(found + sizeof kListening - 1)});
  }
  if (!has_started) start.set_value({false, last});
  free(line);
  fclose(lines);
}

absl::Status CannotStart(const char* what) {
  return absl::InternalError(absl::StrCat("cannot start a local server: ", what, ": ",
                                          std::generic_category().message(errno)));
}

}  // namespace

std::string FindProgram(const std::string& name) {
  const char* const path = std::getenv("PATH");
  for (const auto folder : absl::StrSplit(path == nullptr ? "" : path, ':', absl::SkipEmpty())) {
    const fs::path program = fs::path(std::string(folder.data(), folder.size())) / name;
    if (IsProgram(program)) return program;
  }
  return "";
}

std::string TemporaryDirectory() {
  const char* const directory = std::getenv("TMPDIR");
  return directory == nullptr || *directory == '\0' ? "/tmp" : directory;
}

absl::StatusOr<int> LocalServer::Spawn(const std::string& program) {
  std::string folder = TemporaryDirectory() + "/hullctl-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) return CannotStart(folder.c_str());
  int input[2];
  int log[2];
  if (pipe2(input, O_CLOEXEC) != 0) return CannotStart("pipe");
  if (pipe2(log, O_CLOEXEC) != 0) return CannotStart("pipe");
  std::vector<std::string> arguments = {"sh",
                                        "-c",
                                        kKeeper,
                                        folder,
                                        program,
                                        "--listen",
                                        absl::StrCat("unix:", folder, "/socket"),
                                        "--store",
                                        "memory",
                                        "--drain-timeout",
                                        "1"};
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, input[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, log[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, log[1], STDERR_FILENO);
  // A separate session: Ctrl-C in the terminal ends hullctl, which then ends the server.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  std::vector<char*> variables = EnvironmentWithoutSettings();
  const int failed =
      posix_spawn(&keeper_, "/bin/sh", &files, &attributes, pointers.data(), variables.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(input[0]);
  close(log[1]);
  keeper_input_ = input[1];
  if (failed == 0) return log[0];
  keeper_ = 0;
  close(log[0]);
  rmdir(folder.c_str());
  errno = failed;
  return CannotStart("/bin/sh");
}

absl::StatusOr<std::unique_ptr<LocalServer>> LocalServer::Start() {
  HULLD_ASSIGN_OR_RETURN(const auto program, FindServer());
  std::unique_ptr<LocalServer> server(new LocalServer);
  HULLD_ASSIGN_OR_RETURN(const auto log, server->Spawn(program));
  std::promise<std::pair<bool, std::string>> start;
  auto started = start.get_future();
  server->log_reader_ = std::thread(ReadLog, log, std::move(start));
  const auto [has_started, text] = started.get();
  if (!has_started) {
    return absl::InternalError(absl::StrCat("the local server did not start: ", text));
  }
  server->address_ = text;
  return server;
}

LocalServer::~LocalServer() {
  if (keeper_input_ >= 0) close(keeper_input_);
  while (keeper_ != 0 && waitpid(keeper_, nullptr, 0) < 0 && errno == EINTR) {
  }
  if (log_reader_.joinable()) log_reader_.join();
}

absl::StatusOr<HullMesh> LocalHullBuilder::Build(const Client::PointFeed& feed) {
  if (!client_.has_value()) {
    HULLD_ASSIGN_OR_RETURN(server_, LocalServer::Start());
    ClientOptions options;
    options.server = server_->address();
    options.own_connection = true;
    client_.emplace(std::move(options));
  }
  HULLD_RETURN_IF_ERROR(client_->PutHull("hull", feed));
  return client_->GetHullMesh("hull");
}

}  // namespace hulld
