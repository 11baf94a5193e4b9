// hulld over the wire, with its store in memory and for points also on disk, compared with a no-op
// server with messages of the same sizes (the floor), and with core in this process: in
// alternation, in one run.
//
//   remote_benchmark [--out FILE.csv] [--suite NAME]... [--filter TEXT] [--rounds N] [--seconds S]
//                    [--transport tcp|unix] [--hulld PROGRAM] [--data FOLDER]
//                    [--hulld-flag=FLAG]... [--beside PROGRAM]
//
// Columns: the workload's units per second; the time of a call; `of_floor`: per_second as a
// multiple of the floor's, `p50_of_floor`: p50 as a multiple of the floor's, `of_in_process`:
// per_second as a multiple of core's. Each is the median over rounds; ratios are between neighbors
// in one round. `server_cpu_us`: the server's processor time per unit, which other programs affect
// less than the clock; `cpu_of_floor`: as a multiple of the floor's.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>

#include "tests/bench/csv_reporter.h"
#include "tests/bench/service/remote_subject.h"

namespace hulld::bench {
namespace {

struct Arguments {
  std::string out;
  std::vector<std::string> suites;
  std::string filter;
  std::string transport;
  int rounds = 5;
  double seconds = 0.5;
  std::string hulld = HULLD_PROGRAM;
  std::string beside;
  std::string data = std::filesystem::temp_directory_path();
  std::vector<std::string> hulld_flags;
};

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// One server's rounds of a workload.
struct Rounds {
  std::vector<Sample> samples;
};

double MedianOf(const Rounds& rounds, double Sample::*field) {
  std::vector<double> values;
  for (const Sample& sample : rounds.samples) values.push_back(sample.*field);
  return Median(values);
}

// Returns 0 without a peer.
double MedianRatio(const Rounds& rounds, const Rounds* peer, double Sample::*field) {
  std::vector<double> ratios;
  for (size_t i = 0; peer != nullptr && i < peer->samples.size(); ++i) {
    if (peer->samples[i].*field > 0) {
      ratios.push_back(rounds.samples[i].*field / peer->samples[i].*field);
    }
  }
  return Median(ratios);
}

void Measure(RemoteSubject& subject, const RemoteWorkload& workload, Rounds& rounds) {
  const double processor = subject.ProcessorSeconds();
  const auto start = std::chrono::steady_clock::now();
  Sample sample = workload.run(subject);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double used = subject.ProcessorSeconds() - processor;
  sample.server_cpu_us = 1e6 * used / (seconds * sample.per_second);
  rounds.samples.push_back(sample);
}

class Report {
 public:
  explicit Report(const std::string& path) {
    if (!path.empty()) file_.open(path);
    file_ << "workload,transport,server,unit,per_second,p50_us,p99_us,of_floor,p50_of_floor,"
             "of_in_process,server_cpu_us,cpu_of_floor,rounds,compiler,cpu\n";
  }

  void Write(const RemoteWorkload& workload, const std::string& transport,
             const std::string& server, const Rounds& rounds, const Rounds* floor,
             const Rounds* in_process) {
    const double rate = MedianOf(rounds, &Sample::per_second);
    const double p50 = MedianOf(rounds, &Sample::p50_us);
    const double p99 = MedianOf(rounds, &Sample::p99_us);
    const double of_floor = MedianRatio(rounds, floor, &Sample::per_second);
    const double p50_of_floor = MedianRatio(rounds, floor, &Sample::p50_us);
    const double of_in_process = MedianRatio(rounds, in_process, &Sample::per_second);
    const double cpu = MedianOf(rounds, &Sample::server_cpu_us);
    const double cpu_of_floor = MedianRatio(rounds, floor, &Sample::server_cpu_us);
    std::printf("%-40s %-5s %-11s %11.4g %s/s  p50 %8.1f us  p99 %8.1f us", workload.name.c_str(),
                transport.c_str(), server.c_str(), rate, workload.unit.c_str(), p50, p99);
    if (of_floor > 0) std::printf("  %.3f of floor (p50 %.3f)", of_floor, p50_of_floor);
    if (of_in_process > 0) std::printf("  %.3f of in process", of_in_process);
    if (cpu > 0) std::printf("  server cpu %.3g us", cpu);
    if (cpu_of_floor > 0) std::printf(", %.3f of floor", cpu_of_floor);
    std::printf("\n");
    std::fflush(stdout);
    file_ << '"' << workload.name << "\"," << transport << ',' << server << ',' << workload.unit
          << ',' << rate << ',';
    const auto optional = [this](double value) {
      if (value > 0) file_ << value;
      file_ << ',';
    };
    for (const double value :
         {p50, p99, of_floor, p50_of_floor, of_in_process, cpu, cpu_of_floor}) {
      optional(value);
    }
    file_ << rounds.samples.size() << ',' << CompilerName() << ',' << CpuName() << std::endl;
  }

 private:
  std::ofstream file_;
};

// subjects: the floor first.
void Run(const RemoteWorkload& workload, const std::vector<RemoteSubject*>& subjects, int count,
         Report& report) {
  std::vector<Rounds> rounds(subjects.size());
  Rounds in_process;
  Rounds placing;
  // The first round warms up.
  for (int round = 0; round <= count; ++round) {
    if (round == 1) {
      rounds.assign(subjects.size(), {});
      in_process = {};
      placing = {};
    }
    for (size_t i = 0; i < subjects.size(); ++i) Measure(*subjects[i], workload, rounds[i]);
    if (workload.run_in_process) in_process.samples.push_back(workload.run_in_process());
    if (workload.run_placing) placing.samples.push_back(workload.run_placing());
  }
  const Rounds* core = in_process.samples.empty() ? nullptr : &in_process;
  const std::string& transport = subjects[0]->transport();
  for (size_t i = 0; i < subjects.size(); ++i) {
    const Rounds* floor = i == 0 ? nullptr : &rounds[0];
    report.Write(workload, transport, subjects[i]->name(), rounds[i], floor, core);
  }
  if (core != nullptr) {
    report.Write(workload, transport, "in process", in_process, nullptr, nullptr);
  }
  if (!placing.samples.empty()) {
    report.Write(workload, transport, "placing", placing, nullptr, core);
  }
}

// The servers of a transport, and their files.
struct Servers {
  Servers(const std::string& transport, const Arguments& arguments)
      : folder(std::filesystem::path(arguments.data) /
               ("remote_benchmark_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder);
    const auto address = [&](const char* name) {
      return transport == "tcp" ? "127.0.0.1:0" : "unix:" + (folder / name).string();
    };
    const auto command = [&](const std::string& program, const char* name,
                             const std::string& store) {
      std::vector<std::string> words = {program, "--listen", address(name), store};
      words.insert(words.end(), arguments.hulld_flags.begin(), arguments.hulld_flags.end());
      return words;
    };
    floor.emplace("floor", transport,
                  std::vector<std::string>{HULLD_FLOOR_PROGRAM, address("floor")});
    hulld.emplace("hulld", transport, command(arguments.hulld, "hulld", "--store=memory"));
    if (!arguments.beside.empty()) {
      beside.emplace("beside", transport, command(arguments.beside, "beside", "--store=memory"));
    }
    durable.emplace(
        "hulld durable", transport,
        command(arguments.hulld, "durable", "--data-dir=" + (folder / "store").string()));
  }
  ~Servers() {
    durable.reset();
    beside.reset();
    hulld.reset();
    floor.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }

  std::filesystem::path folder;
  std::optional<RemoteSubject> floor;
  std::optional<RemoteSubject> hulld;
  // Another hulld to compare with.
  std::optional<RemoteSubject> beside;
  // Keeps everything on disk.
  std::optional<RemoteSubject> durable;
};

std::vector<RemoteWorkload> MakeWorkloads(const Arguments& arguments) {
  std::vector<RemoteWorkload> workloads;
  const auto add = [&](const std::string& suite, const auto& make) {
    // Making some workloads takes longer than measuring the rest.
    if (!arguments.suites.empty() && std::find(arguments.suites.begin(), arguments.suites.end(),
                                               suite) == arguments.suites.end()) {
      return;
    }
    for (RemoteWorkload& workload : make()) {
      if (workload.name.find(arguments.filter) != std::string::npos) {
        workloads.push_back(std::move(workload));
      }
    }
  };
  add("check", [&] { return MakeCheckWorkloads(arguments.seconds); });
  add("batch", [&] { return MakeBatchWorkloads(arguments.seconds); });
  add("stream", [&] { return MakeStreamWorkloads(arguments.seconds); });
  add("scene", [&] { return MakeSceneWorkloads(arguments.seconds); });
  add("ingest", [&] { return MakeIngestWorkloads(); });
  return workloads;
}

int Main(int argc, char** argv) {
  CLI::App app("Measures hulld over the wire against a server that does nothing");
  Arguments arguments;
  app.add_option("--out", arguments.out, "Write the numbers to this file");
  app.add_option("--suite", arguments.suites,
                 "check, batch, stream, scene, ingest; all by default");
  app.add_option("--filter", arguments.filter, "Only workloads whose name holds this");
  app.add_option("--transport", arguments.transport, "tcp or unix; both by default");
  app.add_option("--rounds", arguments.rounds, "How often; the median counts")
      ->check(CLI::Range(1, 1000));
  app.add_option("--seconds", arguments.seconds, "Of each round")->check(CLI::PositiveNumber);
  app.add_option("--hulld", arguments.hulld, "Another hulld, as of another version");
  app.add_option("--beside", arguments.beside, "A second hulld, measured in turn with the first");
  app.add_option("--data", arguments.data, "Folder to keep the durable store in meanwhile");
  app.add_option("--hulld-flag", arguments.hulld_flags,
                 "Passed to hulld, as in --hulld-flag=--threads=1");
  CLI11_PARSE(app, argc, argv);

  const std::vector<RemoteWorkload> workloads = MakeWorkloads(arguments);
  Report report(arguments.out);
  for (const std::string transport : {"tcp", "unix"}) {
    if (!arguments.transport.empty() && arguments.transport != transport) continue;
    Servers servers(transport, arguments);
    for (const RemoteWorkload& workload : workloads) {
      std::vector<RemoteSubject*> subjects = {&*servers.floor, &*servers.hulld};
      if (servers.beside.has_value()) subjects.push_back(&*servers.beside);
      // Data that is only read is in memory in both cases.
      if (workload.unit == "points") subjects.push_back(&*servers.durable);
      Run(workload, subjects, arguments.rounds, report);
    }
  }
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Main(argc, argv); }
