// hulld-bench: measures the cost and the accuracy of each query method, on the user's own hulls.

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "tests/bench/trade/trade.h"
#include "tests/bench/trade/trade_queries.h"
#ifdef HULLD_HAVE_CLIENT
#include "tests/bench/trade/hull_sources.h"
#endif

namespace hulld::bench {
namespace {

constexpr int kFailed = 1;
constexpr int kWrongUse = 2;

struct TradeArguments {
  std::vector<std::string> files;
  std::vector<std::string> hull_ids;
  std::string server = "127.0.0.1:50551";
  size_t queries = 480;
  TradeSettings settings;
  std::string csv;
  std::string plot;
};

void AddTradeOptions(CLI::App& command, TradeArguments& arguments) {
#ifdef HULLD_HAVE_CLIENT
  command.add_option(
      "files", arguments.files,
      "Point files to build hulls from: obj, off, ply, xyz, csv, pcd, stl, gltf, dae");
  command.add_option("--hull", arguments.hull_ids, "Hulls of a running server, by ID");
  command.add_option("--server", arguments.server, "Server that stores them: host:port")
      ->capture_default_str();
#endif
  command.add_option("--queries", arguments.queries, "Approximate number of queries")
      ->check(CLI::Range(size_t{TradeQueries::kLevels}, size_t{1000000}))
      ->capture_default_str();
  command.add_option("--rounds", arguments.settings.rounds, "Number of rounds; times are medians")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      .add_option("--max-seconds", arguments.settings.max_seconds,
                  "Omit a method if one round takes longer")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--csv", arguments.csv, "Write the results to this file, as CSV");
  command.add_option("--plot", arguments.plot, "Write a plot to this file, as SVG");
}

// Collects the hulls that the user names, or built-in ones if none. Returns false after reporting
// an error.
bool CollectHulls([[maybe_unused]] const TradeArguments& arguments, std::vector<Hull>& hulls) {
#ifdef HULLD_HAVE_CLIENT
  const auto take = [&](absl::StatusOr<Hull> hull) {
    if (!hull.ok()) {
      std::cerr << "hulld-bench: " << hull.status().message() << "\n";
      return false;
    }
    hulls.push_back(*std::move(hull));
    return true;
  };
  for (const std::string& path : arguments.files) {
    if (!take(HullOfFile(path))) return false;
  }
  for (const std::string& id : arguments.hull_ids) {
    if (!take(HullOfServer(arguments.server, id))) return false;
  }
#endif
  if (hulls.empty()) hulls = MakeOwnHulls();
  return true;
}

bool WriteFile(const std::string& path, const Trade& trade,
               void (*write)(const Trade&, std::ostream&)) {
  if (path.empty()) return true;
  std::ofstream file(path);
  write(trade, file);
  file.close();
  if (file) return true;
  std::cerr << "hulld-bench: cannot write " << path << "\n";
  return false;
}

int RunTrade(const TradeArguments& arguments) {
  std::vector<Hull> hulls;
  if (!CollectHulls(arguments, hulls)) return kFailed;
  const TradeQueries queries = MakeTradeQueries(hulls, arguments.queries / TradeQueries::kLevels);
  size_t least = hulls[0].vertices().size();
  size_t most = least;
  for (const Hull& hull : hulls) {
    least = std::min(least, hull.vertices().size());
    most = std::max(most, hull.vertices().size());
  }
  std::cout << hulls.size() << " hulls of " << least << " to " << most << " vertices\n\n";
  std::vector<TradeMethod> methods = MakeTradeMethods(queries.size);
  const Trade trade = MeasureTrade(queries, methods, arguments.settings);
  WriteTradeTable(trade, std::cout);
  const bool written = WriteFile(arguments.csv, trade, WriteTradeCsv) &&
                       WriteFile(arguments.plot, trade, WriteTradePlot);
  return written && trade.differing == 0 ? 0 : kFailed;
}

int Main(int argc, char** argv) {
  CLI::App app("Measures the cost and the accuracy of each query method");
  app.require_subcommand(1);
  TradeArguments arguments;
  CLI::App* trade = app.add_subcommand(
      "trade", "Speed against accuracy: time, wrong answers, and errors of the depth, by method");
  AddTradeOptions(*trade, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;
  }
  return RunTrade(arguments);
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Main(argc, argv); }
