#ifndef HULLD_TESTS_BENCH_CSV_REPORTER_H_
#define HULLD_TESTS_BENCH_CSV_REPORTER_H_

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

namespace hulld::bench {

// Writes the file of --benchmark_out as the CSV kept in tests/bench/results/: one row for each
// benchmark named "suite/workload/library", with its counters, time (the median if repeated),
// compiler, and CPU. Time is CPU time of the measuring thread, or real time if the benchmark
// requests it.
class CsvReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  // Writes the file. Rows may have different counters, so the columns are known only at the end.
  void Finalize() override;

 private:
  std::vector<Run> rows_;
};

// Columns of every file: the compiler of the benchmark, and its machine.
std::string CompilerName();
std::string CpuName();

// Runs the registered benchmarks: a table on the console, and the CSV in --benchmark_out. Returns
// the exit code.
int RunBenchmarks(int argc, char** argv);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_CSV_REPORTER_H_
