#include "tests/bench/csv_reporter.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <thread>

namespace hulld::bench {
namespace {

#ifdef __clang__
constexpr const char* kCompiler = "clang++ " __clang_version__ " " HULLD_BENCH_FLAGS;
#else
constexpr const char* kCompiler = "g++ " __VERSION__ " " HULLD_BENCH_FLAGS;
#endif

// All counters, in the order of the columns.
constexpr const char* kCounters[] = {"points",
                                     "vertices",
                                     "vertices_missing_or_extra",
                                     "p50_us",
                                     "p99_us",
                                     "p999_us",
                                     "max_us",
                                     "times_generic",
                                     "ns_per_facet",
                                     "filter_signs",
                                     "fixed_point_signs",
                                     "expansion_signs",
                                     "integer_signs",
                                     "queries",
                                     "ns",
                                     "cpu_ns",
                                     "wrong",
                                     "none",
                                     "largest_error",
                                     "missed",
                                     "false_contacts",
                                     "open",
                                     "time_error",
                                     "bracket",
                                     "cached_share",
                                     "pairs"};

// Returns the last two parts of "suite/workload/library", separated by a comma.
std::string WorkloadAndLibrary(const std::string& name) {
  const size_t library = name.rfind('/');
  const size_t workload = name.rfind('/', library - 1) + 1;
  return name.substr(workload, library - workload).append(",").append(name.substr(library + 1));
}

// Writes a count in full, and a measurement with six digits.
void Write(std::ostream& out, double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) {
    out << static_cast<int64_t>(value);
  } else {
    out << value;
  }
}

bool IsFinal(const benchmark::BenchmarkReporter::Run& run) {
  if (run.error_occurred) return false;
  return run.repetitions > 1 ? run.aggregate_name == "median" : true;
}

}  // namespace

std::string CpuName() {
  // Fields of the first processor. On a virtual machine its name may omit the generation.
  std::map<std::string, std::string> values;
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line) && !line.empty();) {
    const size_t colon = line.find(':');
    const size_t name_end = line.find_last_not_of(" \t", colon - 1);
    if (colon + 2 < line.size()) values[line.substr(0, name_end + 1)] = line.substr(colon + 2);
  }
  std::string name = values.contains("model name") ? values["model name"] : "unknown CPU";
  if (values.contains("cpu family")) {
    name += " family " + values["cpu family"] + " model " + values["model"];
  }
  return name.append(" (")
      .append(std::to_string(std::thread::hardware_concurrency()))
      .append(" cores)");
}

std::string CompilerName() { return kCompiler; }

bool CsvReporter::ReportContext(const Context&) { return true; }

void CsvReporter::ReportRuns(const std::vector<Run>& runs) {
  std::copy_if(runs.begin(), runs.end(), std::back_inserter(rows_), IsFinal);
}

void CsvReporter::Finalize() {
  std::vector<std::string> columns;
  std::copy_if(std::begin(kCounters), std::end(kCounters), std::back_inserter(columns),
               [&](const char* counter) {
                 return std::any_of(rows_.begin(), rows_.end(),
                                    [&](const Run& row) { return row.counters.contains(counter); });
               });
  std::ostream& out = GetOutputStream();
  out << "workload,library";
  for (const std::string& column : columns) out << "," << column;
  out << ",milliseconds,compiler,cpu\n";
  const std::string cpu = CpuName();
  for (const Run& row : rows_) {
    out << WorkloadAndLibrary(row.run_name.function_name);
    for (const std::string& column : columns) {
      out << ",";
      if (const auto found = row.counters.find(column); found != row.counters.end()) {
        Write(out, found->second.value);
      }
    }
    const bool is_cpu_time = row.run_name.time_type.empty();
    out << "," << (is_cpu_time ? row.GetAdjustedCPUTime() : row.GetAdjustedRealTime()) << ","
        << kCompiler << "," << cpu << "\n";
  }
  out.flush();
}

int RunBenchmarks(int argc, char** argv) {
  // The CSV is written only if a file is requested.
  bool has_file = false;
  for (int i = 1; i < argc; ++i) {
    has_file |= std::string(argv[i]).starts_with("--benchmark_out=");
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  CsvReporter csv;
  benchmark::RunSpecifiedBenchmarks(nullptr, has_file ? &csv : nullptr);
  return 0;
}

}  // namespace hulld::bench
