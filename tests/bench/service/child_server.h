#ifndef HULLD_TESTS_BENCH_SERVICE_CHILD_SERVER_H_
#define HULLD_TESTS_BENCH_SERVICE_CHILD_SERVER_H_

#include <sys/types.h>

#include <string>
#include <vector>

namespace hulld::bench {

// A server in a child process that prints "listening on ADDRESS" on its standard error. Killed on
// destruction.
class ChildServer {
 public:
  // Aborts with a message if the program does not start listening.
  explicit ChildServer(std::vector<std::string> command);
  ChildServer(const ChildServer&) = delete;
  ChildServer& operator=(const ChildServer&) = delete;
  ~ChildServer();

  const std::string& address() const { return address_; }
  pid_t pid() const { return pid_; }
  // Processor time of all its threads so far, in seconds; and its resident memory.
  double ProcessorSeconds() const;
  double ResidentMebibytes() const;

 private:
  pid_t pid_ = -1;
  std::string address_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_SERVICE_CHILD_SERVER_H_
