#ifndef HULLD_TESTS_BENCH_QUERY_REPORT_H_
#define HULLD_TESTS_BENCH_QUERY_REPORT_H_

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

namespace hulld::bench {

// One row of CSV per benchmark named SET/REGIME/QUESTION/METHOD: the median of its repetitions, and
// its counters, empty where it has none.
class QueryReport : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
};

// What the times were measured on: compiler and its flags, processor.
std::string CompilerName();
std::string ProcessorName();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERY_REPORT_H_
