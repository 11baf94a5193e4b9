#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/load/load.h"
#include "client/hullctl/load/load_subjects.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

constexpr std::chrono::seconds kDefaultDuration(10);
constexpr double kPercentiles[] = {0.5, 0.9, 0.99, 0.999};
constexpr const char* kPercentileNames[] = {"p50", "p90", "p99", "p99.9"};

struct LoadArguments {
  LoadSettings settings;
  LoadPlan plan;
};

using NamedMode = std::pair<const char*, LoadMode>;
constexpr NamedMode kModes[] = {{"check", LoadMode::kCheck},
                                {"batch", LoadMode::kBatch},
                                {"append", LoadMode::kAppend},
                                {"mixed", LoadMode::kMixed}};

// Returns the name of an item of a request.
const char* ItemName(LoadMode mode) {
  return mode == LoadMode::kAppend  ? "points"
         : mode == LoadMode::kMixed ? "pairs and points"
                                    : "pairs";
}

std::string RandomName() {
  std::random_device device;
  return absl::StrCat(absl::Hex(device(), absl::kZeroPad8));
}

double Seconds(std::chrono::nanoseconds time) { return 1e-9 * static_cast<double>(time.count()); }

// Returns three digits in the fitting unit: "950 ns", "1.23 ms".
std::string TimeText(std::chrono::nanoseconds time) {
  const auto ns = static_cast<double>(time.count());
  if (ns < 1e3) return absl::StrFormat("%.0f ns", ns);
  if (ns < 1e6) return absl::StrFormat("%.3g us", 1e-3 * ns);
  if (ns < 1e9) return absl::StrFormat("%.3g ms", 1e-6 * ns);
  return absl::StrFormat("%.3g s", 1e-9 * ns);
}

std::string RateText(double count, double seconds) {
  const double rate = seconds > 0 ? count / seconds : 0;
  if (rate < 1e3) return absl::StrFormat("%.1f", rate);
  return absl::StrFormat("%.0f", rate);
}

std::string CodeName(absl::StatusCode code) { return absl::StatusCodeToString(code); }

void PrintHistogram(const LatencyHistogram& latencies, std::ostream& out) {
  constexpr size_t kWidth = 50;
  const std::vector<LatencyHistogram::Row> rows = latencies.Rows();
  uint64_t max_count = 1;
  for (const LatencyHistogram::Row& row : rows) max_count = std::max(max_count, row.count);
  for (const LatencyHistogram::Row& row : rows) {
    // A bar has at least one character.
    const size_t length = (row.count * kWidth + max_count - 1) / max_count;
    out << absl::StrFormat("  %7s - %-7s %10u  %s\n", TimeText(row.from), TimeText(row.to),
                           row.count, std::string(length, '#'));
  }
}

void PrintLoadTable(const LoadArguments& arguments, const LoadResult& result, std::ostream& out) {
  const uint64_t succeeded = result.latencies.count();
  const double seconds = Seconds(result.elapsed);
  Table table;
  table
      .Row({"requests",
            absl::StrCat(succeeded + result.failed(), ", of which ", result.failed(), " failed")})
      .Row({"time", absl::StrFormat("%.2f s", seconds)})
      .Row({"throughput", RateText(static_cast<double>(succeeded), seconds) + " requests/s"});
  if (arguments.settings.mode != LoadMode::kCheck) {
    table.Row({"", RateText(static_cast<double>(result.items), seconds) + " " +
                       ItemName(arguments.settings.mode) + "/s"});
  }
  if (result.missed > 0) {
    table.Row(
        {"missed", absl::StrCat(result.missed,
                                " requests were due but not sent; the rate was not sustained")});
  }
  for (size_t i = 0; succeeded > 0 && i < std::size(kPercentiles); ++i) {
    table.Row({absl::StrCat("latency ", kPercentileNames[i]),
               TimeText(result.latencies.Percentile(kPercentiles[i]))});
  }
  if (succeeded > 0) table.Row({"latency max", TimeText(result.latencies.max())});
  for (const auto& [code, failures] : result.failures) {
    table.Row({CodeName(code), absl::StrCat(failures.count, ", for example: ", failures.message)});
  }
  table.Print(out);
  if (succeeded == 0) return;
  out << "\n";
  PrintHistogram(result.latencies, out);
}

std::string Number(double value) { return ShortestText(value); }

void PrintLoadJson(const LoadArguments& arguments, bool interrupted, const LoadResult& result,
                   std::ostream& out) {
  const double seconds = Seconds(result.elapsed);
  JsonObject latency;
  for (size_t i = 0; i < std::size(kPercentiles); ++i) {
    latency.AddJson(kPercentileNames[i],
                    Number(Seconds(result.latencies.Percentile(kPercentiles[i]))));
  }
  latency.AddJson("max", Number(Seconds(result.latencies.max())));
  std::vector<std::string> rows;
  for (const LatencyHistogram::Row& row : result.latencies.Rows()) {
    rows.push_back(JsonObject()
                       .AddJson("fromSeconds", Number(Seconds(row.from)))
                       .AddJson("toSeconds", Number(Seconds(row.to)))
                       .Add("count", row.count)
                       .Close());
  }
  std::vector<std::string> failures;
  for (const auto& [code, failure] : result.failures) {
    failures.push_back(JsonObject()
                           .Add("code", CodeName(code))
                           .Add("count", failure.count)
                           .Add("message", failure.message)
                           .Close());
  }
  const auto succeeded = static_cast<double>(result.latencies.count());
  out << JsonObject()
             .Add("mode",
                  std::ranges::find(kModes, arguments.settings.mode, &NamedMode::second)->first)
             .Add("clients", static_cast<uint64_t>(arguments.settings.clients))
             .AddJson("ratePerSecond", arguments.plan.rate ? Number(*arguments.plan.rate) : "null")
             .AddJson("interrupted", interrupted ? "true" : "false")
             .AddJson("seconds", Number(seconds))
             .Add("succeeded", result.latencies.count())
             .Add("failed", result.failed())
             .Add("missed", result.missed)
             .AddJson("requestsPerSecond", Number(seconds > 0 ? succeeded / seconds : 0))
             .Add("item", ItemName(arguments.settings.mode))
             .AddJson("itemsPerSecond",
                      Number(seconds > 0 ? static_cast<double>(result.items) / seconds : 0))
             .AddJson("latencySeconds", latency.Close())
             .AddJson("histogram", JsonArray(rows))
             .AddJson("errors", JsonArray(failures))
             .Close()
      << "\n";
}

LoadResult Drive(const Invocation& run, const LoadArguments& arguments,
                 const std::atomic<bool>& interrupted, LoadSubjects* subjects) {
  constexpr uint64_t kWhole = 1000000;
  ProgressBar bar(run.err, run.shows_progress, "requests", kWhole);
  return RunLoad(arguments.plan, subjects->MakeClients(), interrupted,
                 [&bar](double share, uint64_t requests) {
                   bar.Update(static_cast<uint64_t>(share * static_cast<double>(kWhole)), requests);
                 });
}

// Returns the exit code for a load.
ExitCode LoadExitCode(const LoadResult& result) {
  if (result.failures.empty()) return ExitCode::kDone;
  if (result.latencies.count() > 0) return ExitCode::kSomeFailed;
  const absl::StatusCode code = result.failures.begin()->first;
  const bool unreachable =
      result.failures.size() == 1 &&
      (code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kDeadlineExceeded);
  return unreachable ? ExitCode::kUnreachable : ExitCode::kRequestFailed;
}

ExitCode Load(const Invocation& run, const LoadArguments& given) {
  LoadArguments arguments = given;
  // Recorded, so that the hulls can be deleted.
  std::atomic<bool> interrupted = false;
  const Interrupt interrupt([&interrupted] { interrupted = true; });
  if (!arguments.plan.duration && !arguments.plan.requests)
    arguments.plan.duration = kDefaultDuration;
  std::string& prefix = arguments.settings.prefix;
  if (prefix.empty()) prefix = absl::StrCat("bench-load/", RandomName(), "/");
  if (prefix.back() != '/') prefix += "/";
  // A load measures each request as sent: no retries.
  ClientOptions connection = run.MakeClient().options();
  connection.retry.max_attempts = 1;
  connection.own_connection = true;
  LoadSubjects subjects(arguments.settings, connection);
  const absl::Status created = subjects.Create(interrupted);
  LoadResult result;
  if (created.ok()) result = Drive(run, arguments, interrupted, &subjects);
  const absl::Status deleted = subjects.Delete();
  if (created.ok() && run.json()) {
    PrintLoadJson(arguments, interrupted, result, run.out);
  } else if (created.ok()) {
    PrintLoadTable(arguments, result, run.out);
  }
  if (!deleted.ok()) {
    run.err << "hullctl: some hulls of the load test may remain; see 'hullctl list " << prefix
            << "'\n";
    return run.Fail(deleted);
  }
  if (!created.ok() && !interrupted) return run.Fail(created);
  if (interrupted) run.err << "hullctl: interrupted; deleted the hulls of the load test\n";
  return LoadExitCode(result);
}

void AddPlanOptions(Command command, LoadPlan* plan) {
  command
      .AddParsed("--duration", ParseDuration, &plan->duration,
                 "Duration, such as 30s (default 10s, unless --requests is given)")
      .ValueName("TIME");
  command.AddNumber("--requests", 1, uint64_t{1} << 40, "Total number of requests of all clients",
                    &plan->requests);
  command
      .AddParsed(
          "--rate",
          [](const std::string& text) -> absl::StatusOr<double> {
            double rate = 0;
            if (ParseDouble(text, &rate) == NumberText::kNumber && rate >= 0.01 && rate <= 1e7) {
              return rate;
            }
            return absl::InvalidArgumentError(
                Quoted(text) + " is not a number of requests per second from 0.01 to 1e7");
          },
          &plan->rate, "Total requests per second of all clients (default: as fast as possible)")
      .ValueName("R");
}

void AddSettingOptions(Command command, LoadSettings* settings) {
  command
      .AddChoice("--mode", {std::begin(kModes), std::end(kModes)}, &settings->mode,
                 "check (default), batch, append, or mixed, in the ratio 8:1:1")
      .ValueName("MODE");
  command.AddNumber("--clients", 1, 1000, "Number of clients, each with a connection (default 1)",
                    &settings->clients);
  command.AddNumber("--hulls", 1, 10000, "Number of hulls (default 16)", &settings->hulls);
  command.AddNumber("--vertices", 1, 100000, "Vertices per hull, on a sphere (default 64)",
                    &settings->vertices);
  command.AddNumber("--pairs", 1, 1000000, "Pairs per batch (default 10000)", &settings->pairs);
  command.AddNumber("--points", 1, 160000, "Points per append, in a ball (default 10000)",
                    &settings->points);
  command
      .AddText("--prefix", &settings->prefix,
               "Prefix of the hulls to create and delete (default bench-load/RANDOM/)")
      .ValueName("PREFIX");
}

}  // namespace

void AddBenchCommand(Command program, Invocation* invocation) {
  Command bench = program.AddCommand("bench", "Measure a running server");
  bench.RequireCommand();
  auto arguments = std::make_shared<LoadArguments>();
  Command load = bench.AddCommand(
      "load", "Send requests from several clients; show throughput, latencies, and errors");
  AddSettingOptions(load, &arguments->settings);
  AddPlanOptions(load, &arguments->plan);
  AddFreshnessOptions(load, invocation);
  load.AddFlag(
      "--json", [invocation] { invocation->form = OutputForm::kJson; }, "Same as --output json");
  load.SetDetails(
      "Creates hulls and deletes them at the end, also after Ctrl-C. Without --rate, each client\n"
      "sends its next request as soon as it has an answer. With --rate, requests are due at fixed\n"
      "times and latencies are measured from these, so that queueing behind a slow request is\n"
      "visible. Requests are not retried; latencies are those of successful requests.");
  load.SetExamples(
      {{"Four clients, as fast as possible", "hullctl bench load --clients 4 --duration 30s"},
       {"At a steady rate", "hullctl bench load --rate 500 --mode mixed"},
       {"Several servers over one store; answers may be 200 ms stale",
        "hullctl bench load --clients 64 --max-staleness 200ms"}});
  OnGiven(load, invocation, arguments, Load);
}

}  // namespace hulld
