#include "tests/bench/query_report.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

namespace hulld::bench {
namespace {

constexpr const char* kCounters[] = {"ns",    "questions",    "wrong", "none",
                                     "error", "cached_share", "pairs"};

}  // namespace

std::string CompilerName() {
#ifdef __clang__
  const std::string name = "clang++ ";
#else
  const std::string name = "g++ ";
#endif
  const std::string version = __VERSION__;
  return name + version.substr(0, version.find(' ')) + " " + HULLD_COMPILE_OPTIONS;
}

std::string ProcessorName() {
  std::ifstream file("/proc/cpuinfo");
  std::string name = "unknown processor";
  bool is_virtual = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) name = line.substr(line.find(':') + 2);
    if (line.starts_with("flags")) is_virtual = line.find(" hypervisor") != std::string::npos;
    if (line.empty()) break;
  }
  std::replace(name.begin(), name.end(), ',', ' ');
  std::ostringstream text;
  text << name << " (" << (is_virtual ? "virtual; " : "") << std::thread::hardware_concurrency()
       << " cores)";
  return text.str();
}

bool QueryReport::ReportContext(const Context& /*context*/) {
  GetOutputStream() << "set,regime,question,method";
  for (const char* counter : kCounters) GetOutputStream() << "," << counter;
  GetOutputStream() << ",compiler,cpu\n";
  return true;
}

void QueryReport::ReportRuns(const std::vector<Run>& runs) {
  std::ostream& out = GetOutputStream();
  for (const Run& run : runs) {
    if (run.error_occurred) continue;
    if (run.repetitions > 1 && run.aggregate_name != "median") continue;
    std::string name = run.run_name.function_name;
    std::replace(name.begin(), name.end(), '/', ',');
    out << name;
    for (const char* counter : kCounters) {
      out << ",";
      const auto at = run.counters.find(counter);
      if (at != run.counters.end()) out << static_cast<double>(at->second);
    }
    out << "," << CompilerName() << "," << ProcessorName() << "\n";
  }
  out.flush();
}

}  // namespace hulld::bench
