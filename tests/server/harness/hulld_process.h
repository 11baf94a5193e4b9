#ifndef HULLD_TESTS_SERVER_HARNESS_HULLD_PROCESS_H_
#define HULLD_TESTS_SERVER_HARNESS_HULLD_PROCESS_H_

#include <sys/types.h>

#include <cstdio>
#include <string>
#include <vector>

namespace hulld::server {

// A program, hulld, whose standard error is read here; killed, if it still runs, with this.
class Process {
 public:
  explicit Process(std::vector<std::string> arguments);
  // Another program than hulld, by its path.
  Process(const std::string& program, std::vector<std::string> arguments);
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process();

  // Reads up to the first line that holds `text` and returns it; empty at the end of the output.
  std::string ReadLineWith(const std::string& text);

  // Reads what is left of the output, which ends when the process does.
  void ReadToEnd();

  const std::vector<std::string>& lines() const { return lines_; }
  pid_t pid() const { return pid_; }
  void Signal(int number);

  // The exit status, or -1 when a signal ended it.
  int Wait();

 private:
  pid_t pid_ = -1;
  FILE* errors_ = nullptr;
  bool ended_ = false;
  std::vector<std::string> lines_;
};

// The address in the line in which hulld says that it listens.
std::string AddressIn(const std::string& line);

// An address of this machine that nothing listens at.
std::string UnusedAddress();

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_HULLD_PROCESS_H_
