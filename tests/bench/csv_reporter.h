#ifndef HULLD_TESTS_BENCH_CSV_REPORTER_H_
#define HULLD_TESTS_BENCH_CSV_REPORTER_H_

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

namespace hulld::bench {

// Writes the file of --benchmark_out as the CSV that tests/bench/results/ keeps: one row for each
// benchmark called "suite/workload/library", its median where it was repeated, with what was
// counted, the compiler and the CPU in the row of the time. Time is CPU time of the measuring
// thread, or real time where the benchmark asks for it.
class CsvReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;

 private:
  void WriteHeader(const Run& run);

  // The counters of the first row, which all rows have.
  std::vector<std::string> columns_;
};

// Columns that every file has: what compiled the benchmark, and where it runs.
std::string CompilerName();
std::string CpuName();

// Runs what is registered: a table on the console, and the CSV in --benchmark_out. The exit code.
int RunBenchmarks(int argc, char** argv);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_CSV_REPORTER_H_
