#ifndef HULLD_TESTS_BENCH_SERVICE_CHILD_SERVER_H_
#define HULLD_TESTS_BENCH_SERVICE_CHILD_SERVER_H_

#include <sys/types.h>

#include <string>
#include <vector>

namespace hulld::bench {

// A server in a process of its own, which says "listening on ADDRESS" on its standard error. Killed
// with this.
class ChildServer {
 public:
  // Aborts, saying why, when the program does not come to listen.
  explicit ChildServer(std::vector<std::string> command);
  ChildServer(const ChildServer&) = delete;
  ChildServer& operator=(const ChildServer&) = delete;
  ~ChildServer();

  const std::string& address() const { return address_; }
  pid_t pid() const { return pid_; }
  // Processor time of all its threads so far, in seconds; ResidentMebibytes: what it holds in
  // memory.
  double ProcessorSeconds() const;
  double ResidentMebibytes() const;

 private:
  pid_t pid_ = -1;
  std::string address_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_SERVICE_CHILD_SERVER_H_
