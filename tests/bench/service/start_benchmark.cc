// Startup time of hulld on a durable store, and its memory afterwards.
//
//   start_benchmark [--points N] [HULLS...]
//
// For each number of hulls (by default 0, 1000, 10000 and 100000): fills a store in a temporary
// directory, each hull from N (64) points on a sphere, kills the server, and starts it five times.
// One row of CSV per number: medians of the time from the start of the process until it listens and
// until the first answer about two hulls, and its resident memory then. The files are in the page
// cache: this is a restart of the program, not of the machine.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kStarts = 5;
// Many, so that the store commits many hulls together.
constexpr int kWriters = 64;

std::string IdOf(int hull) { return "start/" + std::to_string(hull); }

void Fill(const std::string& address, int hulls, int points) {
  std::atomic<int> next = 0;
  std::vector<std::thread> writers;
  for (int i = 0; i < kWriters; ++i) {
    writers.emplace_back([&] {
      const auto stub = v1::HullService::NewStub(
          grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
      for (int hull = next++; hull < hulls; hull = next++) {
        MakeBallHull(*stub, IdOf(hull), points, 1 + 1e-6 * hull);
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
}

// Queries the first hull and the last one.
void Check(const std::string& address, int hulls) {
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  v1::CheckCollisionRequest request;
  v1::CheckCollisionResponse response;
  request.mutable_a()->set_hull_id(IdOf(0));
  request.mutable_b()->set_hull_id(IdOf(hulls - 1));
  Require(stub->CheckCollision(&context, request, &response), "CheckCollision");
}

double DirectoryMebibytes(const std::string& directory) {
  double bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) bytes += static_cast<double>(entry.file_size());
  }
  return bytes / (1 << 20);
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void Measure(int hulls, int points) {
  std::string directory = (std::filesystem::temp_directory_path() / "hulld-start-XXXXXX").string();
  if (mkdtemp(directory.data()) == nullptr) std::abort();
  const std::vector<std::string> command = {
      HULLD_PROGRAM, "--listen",    "127.0.0.1:0", "--store",  "rocksdb",
      "--data-dir",  directory,     "--max-hulls", "10000000", "--max-streams-per-client",
      "100000",      "--log-level", "info"};
  const Clock::time_point filling = Clock::now();
  {
    const ChildServer server(command);
    Fill(server.address(), hulls, points);
  }
  const double fill_s = std::chrono::duration<double>(Clock::now() - filling).count();
  std::vector<double> listening;
  std::vector<double> answered;
  std::vector<double> memory;
  for (int i = 0; i < kStarts; ++i) {
    const Clock::time_point start = Clock::now();
    const auto passed = [start] {
      return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    };
    const ChildServer server(command);
    listening.push_back(passed());
    if (hulls > 0) Check(server.address(), hulls);
    answered.push_back(passed());
    memory.push_back(server.ResidentMebibytes());
  }
  std::printf("%d,%d,%.1f,%.1f,%.1f,%.1f,%.1f\n", hulls, points, fill_s, Median(listening),
              Median(answered), Median(memory), DirectoryMebibytes(directory));
  std::fflush(stdout);
  std::filesystem::remove_all(directory);
}

int Run(int argc, char** argv) {
  int points = 64;
  std::vector<int> counts;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--points" && i + 1 < argc) {
      points = std::atoi(argv[++i]);
    } else {
      counts.push_back(std::atoi(argv[i]));
    }
  }
  if (counts.empty()) counts = {0, 1000, 10'000, 100'000};
  std::printf("hulls,points,fill_s,listens_ms,answers_ms,resident_mib,store_mib\n");
  for (const int hulls : counts) Measure(hulls, points);
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main(int argc, char** argv) { return hulld::bench::Run(argc, argv); }
