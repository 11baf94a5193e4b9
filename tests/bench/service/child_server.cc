#include "tests/bench/service/child_server.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace hulld::bench {

ChildServer::ChildServer(std::vector<std::string> command) {
  constexpr char kListening[] = "listening on ";
  int ends[2];
  if (pipe(ends) != 0) std::abort();
  pid_ = fork();
  if (pid_ == 0) {
    // Ends with its parent in any case.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    std::vector<char*> argv;
    for (std::string& argument : command) argv.push_back(argument.data());
    argv.push_back(nullptr);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  FILE* const errors = fdopen(ends[0], "r");
  char line[4096];
  while (address_.empty() && fgets(line, sizeof line, errors) != nullptr) {
    const std::string text(line);
    const size_t at = text.find(kListening);
    if (at == std::string::npos) continue;
    const size_t start = at + sizeof kListening - 1;
    address_ = text.substr(start, text.find_first_of("\"\n", start) - start);
  }
  if (address_.empty()) {
    std::fprintf(stderr, "%s does not listen\n", command[0].c_str());
    std::abort();
  }
  // Later output is not read, which its log tolerates.
  fclose(errors);
}

ChildServer::~ChildServer() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

double ChildServer::ProcessorSeconds() const {
  clockid_t clock;
  timespec time = {};
  if (clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double ChildServer::ResidentMebibytes() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/statm");
  double total = 0;
  double resident = 0;
  status >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

}  // namespace hulld::bench
