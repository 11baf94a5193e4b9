#ifndef HULLD_TESTS_SERVER_HARNESS_HULLD_PROCESS_H_
#define HULLD_TESTS_SERVER_HARNESS_HULLD_PROCESS_H_

#include <sys/types.h>

#include <cstdio>
#include <string>
#include <vector>

namespace hulld::server {

// A child process, by default hulld, with its standard error readable. Killed on destruction if
// still running.
class Process {
 public:
  explicit Process(std::vector<std::string> arguments);
  // Runs another program, by its path.
  Process(const std::string& program, std::vector<std::string> arguments);
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process();

  // Reads up to the first line that contains `text` and returns it; empty at the end of the output.
  std::string ReadLineWith(const std::string& text);

  // Reads the remaining output, until the process ends.
  void ReadToEnd();

  const std::vector<std::string>& lines() const { return lines_; }
  pid_t pid() const { return pid_; }
  void Signal(int number);

  // Returns the exit status, or -1 if a signal ended it.
  int Wait();

 private:
  pid_t pid_ = -1;
  FILE* errors_ = nullptr;
  bool ended_ = false;
  std::vector<std::string> lines_;
};

// Returns the address in hulld's "listening" log line.
std::string AddressIn(const std::string& line);

// Returns a local address without a listener.
std::string UnusedAddress();

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HULLD_PROCESS_H_
