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

// Measuring several programs in turn, and the rows that tell of it.
namespace hulld::bench {

using Clock = std::chrono::steady_clock;

// Ends the program, saying why.
[[noreturn]] void Fail(const std::string& what);

// Seconds.
double Since(Clock::time_point start);
// 0 of nothing.
double Median(std::vector<double> values);
double Mean(const std::vector<double>& values);

// Processor time of all programs called postgres, those that have ended included, in seconds; in
// steps of 10 ms.
double DatabaseSeconds();

// What is measured in turn: by name, with the server whose processor time counts, if any.
struct Subject {
  std::string name;
  const ChildServer* server = nullptr;
  // Takes a while; the microseconds of each request.
  std::function<std::vector<double>()> run;
  // One of each round.
  std::vector<double> p50 = {}, p99 = {}, rate = {}, cpu_us = {}, database_cpu_us = {};
  std::vector<double> all = {};
};

// Runs `once` this many times; returns the microseconds of each.
std::vector<double> Timed(int times, const std::function<void()>& once);

// Rounds in which each is run once, until this time has passed.
void RunRounds(std::vector<Subject>& subjects, double seconds);

// Rows of a CSV on the standard output, or in a file if a path is given. Each line ends with the
// load, the compiler and the CPU.
class Rows {
 public:
  // kAppend: after what the file holds, whose header stays.
  enum class Mode { kWrite, kAppend };

  // header: names the columns before those. Ends the program where the file cannot be written.
  Rows(const std::string& path, const char* header, Mode mode = Mode::kWrite);
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  ~Rows();

  // Without the columns that each line ends with.
  void Add(const std::string& row);

 private:
  std::FILE* out_ = stdout;
};

// A row for each subject. peer_of: the one that a subject is compared with.
void Report(const Arguments& arguments, std::vector<Subject>& subjects,
            const std::map<std::string, std::string>& peer_of);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_POSTGRES_ROUNDS_H_
