// hulld over PostgreSQL compared with hulld over RocksDB, libpq alone, and gRPC alone. They
// alternate within one run, so that machine drift affects all of them.
//
//   postgres_benchmark SUITE --database CONNINFO --folder FOLDER [--out FILE.csv] [--seconds S]
//                      [--clients N] [--hulls N] [--from N] [--hulld PROGRAM]
//
//   commit     single-point chunks, in sequence
//   queries  CheckCollision, LINEARIZABLE and BOUNDED, by N clients
//   bounded    as queries, BOUNDED only, in short turns: processor time, with a second RocksDB
//              server that shows the difference between two identical servers
//   ingest     points of a ball into one hull
//   fill       makes hulls FROM to N of 64 vertices in the database "bench_start"; prints the rate
//   start      starts five times over the hulls of fill
//   cold       queries about pairs of them that are not in memory
//
// CONNINFO: of a role that may create databases, on a server that trusts it. FOLDER: for RocksDB's
// hulls and the files that servers read. `cpu_us`: processor time of the server per request;
// `database_cpu_us`: that of all processes of PostgreSQL, in steps of 10 ms.

#include <functional>
#include <map>
#include <string>

#include "tests/bench/postgres/rounds.h"
#include "tests/bench/postgres/suites.h"

namespace hulld::bench {
namespace {

int Run(int argc, char** argv) {
  Arguments arguments;
  const std::map<std::string, void (*)(const Arguments&)> suites = {
      {"commit", MeasureCommits}, {"queries", MeasureQueries}, {"bounded", MeasureBounded},
      {"cold", MeasureCold},      {"ingest", MeasureIngest},   {"fill", Fill},
      {"start", MeasureStarts}};
  const std::map<std::string, std::function<void(const std::string&)>> flags = {
      {"--database", [&](const std::string& value) { arguments.database = value; }},
      {"--folder", [&](const std::string& value) { arguments.folder = value; }},
      {"--out", [&](const std::string& value) { arguments.out = value; }},
      {"--hulld", [&](const std::string& value) { arguments.hulld = value; }},
      {"--seconds", [&](const std::string& value) { arguments.seconds = std::stod(value); }},
      {"--clients", [&](const std::string& value) { arguments.clients = std::stoi(value); }},
      {"--from", [&](const std::string& value) { arguments.from = std::stoi(value); }},
      {"--hulls", [&](const std::string& value) { arguments.hulls = std::stoi(value); }}};
  if (argc < 2 || !suites.contains(argv[1]) || argc % 2 != 0) {
    Fail("usage: postgres_benchmark SUITE [FLAG VALUE]...; the head of its source tells");
  }
  for (int i = 2; i < argc; i += 2) {
    const auto flag = flags.find(argv[i]);
    if (flag == flags.end()) Fail(std::string(argv[i]) + " is no flag");
    flag->second(argv[i + 1]);
  }
  if (arguments.database.empty() || arguments.folder.empty()) Fail("needs --database and --folder");
  suites.at(argv[1])(arguments);
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Run(argc, argv); }
