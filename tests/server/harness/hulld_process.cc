#include "tests/server/harness/hulld_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>
#include <utility>

namespace hulld::server {
namespace {

// Returns an environment in which hulld stores nothing on disk by default, so that tests leave no
// files behind.
std::vector<char*> Environment() {
  static char memory[] = "HULLD_STORE=memory";
  std::vector<char*> environment;
  bool chosen = false;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    environment.push_back(*variable);
    chosen |= std::string_view(*variable).starts_with("HULLD_STORE=");
  }
  if (!chosen) environment.push_back(memory);
  environment.push_back(nullptr);
  return environment;
}

}  // namespace

Process::Process(std::vector<std::string> arguments)
    : Process(HULLD_PROGRAM, std::move(arguments)) {}

Process::Process(const std::string& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) std::abort();
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  // Avoids fork(): client threads run here, and the child would deadlock on any lock that one of
  // them holds.
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  ended_ = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(),
                       Environment().data()) != 0;
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  errors_ = fdopen(ends[0], "r");
}

Process::~Process() {
  if (!ended_) {
    Signal(SIGKILL);
    Wait();
  }
  fclose(errors_);
}

std::string Process::ReadLineWith(const std::string& text) {
  char line[4096];
  while (fgets(line, sizeof line, errors_) != nullptr) {
    lines_.emplace_back(line);
    if (lines_.back().find(text) != std::string::npos) return lines_.back();
  }
  return "";
}

void Process::ReadToEnd() {
  char line[4096];
  while (fgets(line, sizeof line, errors_) != nullptr) lines_.emplace_back(line);
}

void Process::Signal(int number) {
  if (!ended_) kill(pid_, number);
}

int Process::Wait() {
  int status = 0;
  if (ended_ || waitpid(pid_, &status, 0) != pid_) return -1;
  ended_ = true;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string AddressIn(const std::string& line) {
  const size_t start = line.find("listening on ") + 13;
  return line.substr(start, line.find_first_of("\"\n", start) - start);
}

std::string UnusedAddress() {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(descriptor, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    std::abort();
  }
  close(descriptor);
  return "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

}  // namespace hulld::server
