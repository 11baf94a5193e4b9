#ifndef HULLD_TESTS_BENCH_POSTGRES_ROUNDS_H_
#define HULLD_TESTS_BENCH_POSTGRES_ROUNDS_H_

#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/bench/postgres/suites.h"
#include "tests/bench/service/child_server.h"

// Alternating measurement of several programs, and its output rows.
namespace hulld::bench {

using Clock = std::chrono::steady_clock;

// Ends the program with a message.
[[noreturn]] void Fail(const std::string& what);

// Returns the seconds since `start`.
double Since(Clock::time_point start);
// 0 for empty input.
double Median(std::vector<double> values);
double Mean(const std::vector<double>& values);

// Returns the processor time of all programs named postgres, including ended ones, in seconds; in
// steps of 10 ms.
double DatabaseSeconds();

// A measured subject: its name, and the server with the processor time to report, if any.
struct Subject {
  std::string name;
  const ChildServer* server = nullptr;
  // Runs for a while; returns the microseconds of each request.
  std::function<std::vector<double>()> run;
  // One value per round.
  std::vector<double> p50 = {}, p99 = {}, rate = {}, cpu_us = {}, database_cpu_us = {};
  std::vector<double> all = {};
};

// Runs `once` this many times; returns the microseconds of each.
std::vector<double> Timed(int times, const std::function<void()>& once);

// Runs rounds, with one run of each subject, until this time has passed.
void RunRounds(std::vector<Subject>& subjects, double seconds);

// Rows of a CSV on standard output, or in a file if a path is given. Each line ends with the load,
// the compiler, and the CPU.
class Rows {
 public:
  // kAppend: appends to the file and keeps its header.
  enum class Mode { kWrite, kAppend };

  // header: names the preceding columns. Ends the program if the file is not writable.
  Rows(const std::string& path, const char* header, Mode mode = Mode::kWrite);
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  ~Rows();

  // row: without the columns that end each line.
  void Add(const std::string& row);

 private:
  std::FILE* out_ = stdout;
};

// Writes a row for each subject. peer_of: the subject to compare with.
void Report(const Arguments& arguments, std::vector<Subject>& subjects,
            const std::map<std::string, std::string>& peer_of);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_POSTGRES_ROUNDS_H_
