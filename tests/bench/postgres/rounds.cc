#include "tests/bench/postgres/rounds.h"

#include <absl/strings/str_format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/bench/csv_reporter.h"
#include "tests/bench/service/growing_writer.h"

namespace hulld::bench {
namespace {

double LoadAverage() {
  std::ifstream file("/proc/loadavg");
  double load = 0;
  file >> load;
  return load;
}

void RunOnce(Subject& subject) {
  const double database = DatabaseSeconds();
  const double used = subject.server == nullptr ? 0 : subject.server->ProcessorSeconds();
  const Clock::time_point began = Clock::now();
  std::vector<double> taken = subject.run();
  const double passed = Since(began);
  if (taken.empty()) Fail(subject.name + " had nothing to ask");
  const auto count = static_cast<double>(taken.size());
  if (subject.server != nullptr) {
    subject.cpu_us.push_back(1e6 * (subject.server->ProcessorSeconds() - used) / count);
  }
  // Negative if a process of PostgreSQL ended during the run.
  const double used_there = DatabaseSeconds() - database;
  if (used_there >= 0) subject.database_cpu_us.push_back(1e6 * used_there / count);
  subject.rate.push_back(count / passed);
  subject.all.insert(subject.all.end(), taken.begin(), taken.end());
  std::sort(taken.begin(), taken.end());
  subject.p50.push_back(Percentile(taken, 0.5));
  subject.p99.push_back(Percentile(taken, 0.99));
}

// Returns the median of the ratios within each round.
double MedianRatio(const std::vector<double>& values, const std::vector<double>& peers) {
  std::vector<double> ratios;
  for (size_t i = 0; i < std::min(values.size(), peers.size()); ++i) {
    if (peers[i] > 0) ratios.push_back(values[i] / peers[i]);
  }
  return Median(ratios);
}

}  // namespace

void Fail(const std::string& what) {
  std::fprintf(stderr, "postgres_benchmark: %s\n", what.c_str());
  std::exit(1);
}

double Since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double DatabaseSeconds() {
  double ticks = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    if (entry.path().filename().string().find_first_not_of("0123456789") != std::string::npos) {
      continue;
    }
    std::ifstream file(entry.path() / "stat");
    std::string stat{std::istreambuf_iterator<char>(file), {}};
    if (stat.find("(postgres)") == std::string::npos) continue;
    std::istringstream fields(stat.substr(stat.rfind(')') + 1));
    std::vector<std::string> field{std::istream_iterator<std::string>(fields), {}};
    // Counting from the third field, state: utime, stime, and the times of waited-for children.
    for (const int i : {11, 12, 13, 14}) ticks += std::atof(field[i].c_str());
  }
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

std::vector<double> Timed(int times, const std::function<void()>& once) {
  std::vector<double> taken;
  for (int i = 0; i < times; ++i) {
    const Clock::time_point start = Clock::now();
    once();
    taken.push_back(1e6 * Since(start));
  }
  return taken;
}

void RunRounds(std::vector<Subject>& subjects, double seconds) {
  const Clock::time_point start = Clock::now();
  for (size_t round = 0; Since(start) < seconds; ++round) {
    for (size_t i = 0; i < subjects.size(); ++i) {
      // Alternates the order.
      RunOnce(subjects[round % 2 == 0 ? i : subjects.size() - 1 - i]);
    }
  }
}

Rows::Rows(const std::string& path, const char* header, Mode mode) {
  const bool continues = mode == Mode::kAppend && std::filesystem::exists(path);
  if (!path.empty()) out_ = std::fopen(path.c_str(), mode == Mode::kAppend ? "a" : "w");
  if (out_ == nullptr) Fail("cannot write " + path);
  if (!continues) std::fprintf(out_, "%s,load,compiler,cpu\n", header);
}

Rows::~Rows() {
  if (out_ != stdout) std::fclose(out_);
}

void Rows::Add(const std::string& row) {
  std::fprintf(out_, "%s,%.1f,%s,%s\n", row.c_str(), LoadAverage(), CompilerName().c_str(),
               CpuName().c_str());
}

void Report(const Arguments& arguments, std::vector<Subject>& subjects,
            const std::map<std::string, std::string>& peer_of) {
  Rows rows(arguments.out,
            "server,clients,p50_us,p99_us,per_second,cpu_us,database_cpu_us,peer,p50_of_peer,"
            "p99_of_peer,cpu_of_peer,requests,rounds");
  for (Subject& subject : subjects) std::sort(subject.all.begin(), subject.all.end());
  for (const Subject& subject : subjects) {
    const double p99 = Percentile(subject.all, 0.99);
    std::string compared = ",,,";
    for (const Subject& peer : subjects) {
      const auto name = peer_of.find(subject.name);
      if (name == peer_of.end() || peer.name != name->second) continue;
      compared = absl::StrFormat("%s,%.3f,%.3f,%.3f", peer.name, MedianRatio(subject.p50, peer.p50),
                                 p99 / Percentile(peer.all, 0.99),
                                 MedianRatio(subject.cpu_us, peer.cpu_us));
    }
    rows.Add(absl::StrFormat(
        "%s,%d,%.1f,%.1f,%.0f,%.1f,%.1f,%s,%d,%d", subject.name, arguments.clients,
        Percentile(subject.all, 0.5), p99, Median(subject.rate), Median(subject.cpu_us),
        Mean(subject.database_cpu_us), compared, subject.all.size(), subject.rate.size()));
  }
}

}  // namespace hulld::bench
