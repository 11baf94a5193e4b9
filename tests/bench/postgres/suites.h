#ifndef HULLD_TESTS_BENCH_POSTGRES_SUITES_H_
#define HULLD_TESTS_BENCH_POSTGRES_SUITES_H_

#include <string>

namespace hulld::bench {

// Command-line arguments (postgres_benchmark.cc).
struct Arguments {
  std::string database;
  std::string folder;
  std::string out;
  std::string hulld = HULLD_PROGRAM;
  double seconds = 60;
  int clients = 1;
  int from = 0;
  int hulls = 10'000;
};

// Vertices of each hull.
constexpr int kVertices = 64;
// The database that Fill makes and later suites use.
constexpr char kStartDatabase[] = "bench_start";
std::string StartHull(int i);

// Writes (write_suites.cc).
void MeasureCommits(const Arguments& arguments);
void MeasureIngest(const Arguments& arguments);

// Queries (query_suites.cc).
void MeasureQueries(const Arguments& arguments);
void MeasureBounded(const Arguments& arguments);
void MeasureCold(const Arguments& arguments);

// Starts (start_suites.cc).
void Fill(const Arguments& arguments);
void MeasureStarts(const Arguments& arguments);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_POSTGRES_SUITES_H_
