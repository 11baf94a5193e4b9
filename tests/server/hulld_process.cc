#include "tests/server/hulld_process.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

namespace hulld::server {

Process::Process(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), HULLD_PROGRAM);
  int ends[2];
  if (pipe(ends) != 0) return;
  pid_ = fork();
  if (pid_ == 0) {
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    // Unless the arguments say otherwise: tests leave nothing behind.
    setenv("HULLD_STORE", "memory", 0);
    execv(HULLD_PROGRAM, argv.data());
    _exit(127);
  }
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

void Process::Signal(int number) { kill(pid_, number); }

int Process::Wait() {
  int status = 0;
  waitpid(pid_, &status, 0);
  ended_ = true;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string AddressIn(const std::string& line) {
  const size_t start = line.find("listening on ") + 13;
  return line.substr(start, line.find_first_of("\"\n", start) - start);
}

}  // namespace hulld::server
