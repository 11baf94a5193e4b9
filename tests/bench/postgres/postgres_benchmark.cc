// hulld over PostgreSQL beside hulld over RocksDB, beside libpq alone and beside gRPC alone: in
// alternation, in one run, so that a drift of the machine's speed reaches all of them.
//
//   postgres_benchmark SUITE --database CONNINFO --folder FOLDER [--out FILE.csv] [--seconds S]
//                      [--clients N] [--hulls N] [--from N] [--hulld PROGRAM]
//
//   commit     chunks of one point, one after the other
//   questions  CheckCollision, LINEARIZABLE and BOUNDED, by N clients
//   bounded    the same, BOUNDED alone, in short turns: processor time, beside a second RocksDB,
//              which tells how far two servers differ that are the same
//   ingest     points of a ball into one hull
//   fill       makes hulls FROM to N of 64 vertices in the database "bench_start"; prints the rate
//   start      starts five times over what fill made
//   cold       questions about pairs of it that are not in memory
//
// CONNINFO: of a role that may make databases, of a server that trusts it. FOLDER: where RocksDB
// keeps its hulls, and what servers read. `cpu_us`: processor time of the server for one request;
// `database_cpu_us`: that of all processes of PostgreSQL, in steps of 10 ms.

#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "hulld/v1/collision.grpc.pb.h"
#include "hulld/v1/hull.grpc.pb.h"
#include "tests/bench/csv_reporter.h"
#include "tests/bench/postgres/libpq_floor.h"
#include "tests/bench/service/ball_hull.h"
#include "tests/bench/service/child_server.h"
#include "tests/bench/service/growing_writer.h"

namespace hulld::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Arguments {
  std::string suite;
  std::string database;
  std::string folder;
  std::string out;
  std::string hulld = HULLD_PROGRAM;
  double seconds = 60;
  int clients = 1;
  int from = 0;
  int hulls = 10'000;
};

[[noreturn]] void Fail(const std::string& what) {
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

double ProcessorSeconds(pid_t pid) {
  clockid_t clock;
  timespec time = {};
  if (clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Of all programs called postgres, those that have ended included.
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
    // From state, the third, on: utime, stime and those of children that were waited for.
    for (const int i : {11, 12, 13, 14}) ticks += std::atof(field[i].c_str());
  }
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double LoadAverage() {
  std::ifstream file("/proc/loadavg");
  double load = 0;
  file >> load;
  return load;
}

// The databases of this run, and how hulld is started over them.
class Stores {
 public:
  explicit Stores(const Arguments& arguments) : arguments_(arguments) {
    std::filesystem::create_directories(arguments.folder);
  }

  std::string Conninfo(const std::string& database) const {
    return arguments_.database + " dbname=" + database;
  }
  // An empty one.
  void Make(const std::string& database) const {
    const std::string admin = Conninfo("postgres");
    AskDatabase(admin, "DROP DATABASE IF EXISTS " + database + " WITH (FORCE)");
    AskDatabase(admin, "CREATE DATABASE " + database);
  }
  // kind: rocksdb, one, many or shard; the last is many, in a file of one shard. name: of the
  // database or directory.
  std::unique_ptr<ChildServer> Start(const std::string& kind, const std::string& name) const {
    std::vector<std::string> command = {
        arguments_.hulld, "--listen",    "127.0.0.1:0", "--max-hulls",
        "100000000",      "--log-level", "info",        "--max-streams-per-client",
        "100000"};
    const auto add = [&](std::initializer_list<std::string> more) {
      command.insert(command.end(), more);
    };
    if (kind == "rocksdb") {
      add({"--data-dir", arguments_.folder + "/" + name});
      return std::make_unique<ChildServer>(command);
    }
    const std::string conninfo = arguments_.folder + "/" + name + ".conninfo";
    std::ofstream(conninfo) << Conninfo(name) << "\n";
    chmod(conninfo.c_str(), 0600);
    add({"--store", "postgres", "--postgres-servers", kind == "one" ? "one" : "many"});
    if (kind == "shard") {
      const std::string shards = arguments_.folder + "/" + name + ".shards";
      std::ofstream(shards) << "0-1023 " << conninfo << "\n";
      add({"--postgres-shards", shards});
    } else {
      add({"--postgres-conninfo-file", conninfo});
    }
    return std::make_unique<ChildServer>(command);
  }
  // The same, over nothing.
  std::unique_ptr<ChildServer> StartEmpty(const std::string& kind) const {
    const std::string name = "bench_" + kind;
    if (kind == "rocksdb") {
      std::filesystem::remove_all(arguments_.folder + "/" + name);
    } else {
      Make(name);
    }
    return Start(kind, name);
  }
  std::unique_ptr<ChildServer> StartFloor() const {
    return std::make_unique<ChildServer>(
        std::vector<std::string>{HULLD_FLOOR_PROGRAM, "127.0.0.1:0"});
  }

 private:
  const Arguments& arguments_;
};

// What is measured in turn: by name, with the process that serves it, if any.
struct Subject {
  std::string name;
  pid_t pid = 0;
  // Takes a while; the microseconds of each request.
  std::function<std::vector<double>()> run;
  // One of each round.
  std::vector<double> p50 = {}, p99 = {}, rate = {}, cpu_us = {}, database_cpu_us = {};
  std::vector<double> all = {};
};

void RunRounds(std::vector<Subject>& subjects, double seconds) {
  const Clock::time_point start = Clock::now();
  for (size_t round = 0; Since(start) < seconds; ++round) {
    for (size_t i = 0; i < subjects.size(); ++i) {
      // Not always after the same one.
      Subject& subject = subjects[(round % 2 == 0 ? i : subjects.size() - 1 - i)];
      const double database = DatabaseSeconds();
      const double used = subject.pid == 0 ? 0 : ProcessorSeconds(subject.pid);
      const Clock::time_point began = Clock::now();
      std::vector<double> taken = subject.run();
      const double passed = Since(began);
      const auto count = static_cast<double>(taken.size());
      if (subject.pid != 0) {
        subject.cpu_us.push_back(1e6 * (ProcessorSeconds(subject.pid) - used) / count);
      }
      // Less than nothing where a process of PostgreSQL ended meanwhile.
      const double used_there = DatabaseSeconds() - database;
      if (used_there >= 0) subject.database_cpu_us.push_back(1e6 * used_there / count);
      subject.rate.push_back(count / passed);
      subject.all.insert(subject.all.end(), taken.begin(), taken.end());
      std::sort(taken.begin(), taken.end());
      subject.p50.push_back(Percentile(taken, 0.5));
      subject.p99.push_back(Percentile(taken, 0.99));
    }
  }
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// Of neighbours in one round.
double MedianRatio(const std::vector<double>& values, const std::vector<double>& peers) {
  std::vector<double> ratios;
  for (size_t i = 0; i < std::min(values.size(), peers.size()); ++i) {
    if (peers[i] > 0) ratios.push_back(values[i] / peers[i]);
  }
  return Median(ratios);
}

// peer_of: whom a subject is compared with.
void Report(const Arguments& arguments, std::vector<Subject>& subjects,
            const std::map<std::string, std::string>& peer_of) {
  const std::string path = arguments.out;
  std::FILE* const out = path.empty() ? stdout : std::fopen(path.c_str(), "w");
  if (out == nullptr) Fail("cannot write " + path);
  std::fprintf(out,
               "server,clients,p50_us,p99_us,per_second,cpu_us,database_cpu_us,peer,p50_of_peer,"
               "p99_of_peer,cpu_of_peer,requests,rounds,load,compiler,cpu\n");
  for (Subject& subject : subjects) {
    std::sort(subject.all.begin(), subject.all.end());
    const double p99 = Percentile(subject.all, 0.99);
    std::fprintf(out, "%s,%d,%.1f,%.1f,%.0f,%.1f,%.1f,", subject.name.c_str(), arguments.clients,
                 Percentile(subject.all, 0.5), p99, Median(subject.rate), Median(subject.cpu_us),
                 Mean(subject.database_cpu_us));
    const auto name = peer_of.find(subject.name);
    if (name == peer_of.end()) {
      std::fprintf(out, ",,,,");
    } else {
      for (const Subject& peer : subjects) {
        if (peer.name != name->second) continue;
        std::fprintf(out, "%s,%.3f,%.3f,%.3f,", peer.name.c_str(),
                     MedianRatio(subject.p50, peer.p50), p99 / Percentile(peer.all, 0.99),
                     MedianRatio(subject.cpu_us, peer.cpu_us));
      }
    }
    std::fprintf(out, "%zu,%zu,%.1f,%s,%s\n", subject.all.size(), subject.rate.size(),
                 LoadAverage(), CompilerName().c_str(), CpuName().c_str());
  }
  if (out != stdout) std::fclose(out);
}

constexpr char kHull[] = "commit/hull";
constexpr int kVertices = 64;

void MeasureCommits(const Arguments& arguments) {
  constexpr int kCommitsEach = 200;
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<std::unique_ptr<GrowingWriter>> writers;
  std::vector<std::unique_ptr<LibpqFloor>> floors;
  std::vector<Subject> subjects;
  const auto timed = [](const std::function<void()>& once) {
    std::vector<double> taken;
    for (int i = 0; i < kCommitsEach; ++i) {
      const Clock::time_point start = Clock::now();
      once();
      taken.push_back(1e6 * Since(start));
    }
    return taken;
  };
  const auto add_server = [&](const std::string& name, std::unique_ptr<ChildServer> server) {
    const auto channel = ConnectAlone(server->address());
    if (name != "gRPC alone") {
      MakeBallHull(*v1::HullService::NewStub(channel), kHull, kVertices, 1);
    }
    writers.push_back(std::make_unique<GrowingWriter>(channel, kHull, "bench"));
    GrowingWriter* const writer = writers.back().get();
    subjects.push_back({.name = name, .pid = server->pid(), .run = [=] {
                          return timed([=] { writer->SendAndReceive(); });
                        }});
    servers.push_back(std::move(server));
  };
  for (const bool shared : {false, true}) {
    // What a hulld left is what libpq repeats.
    const std::string kind = shared ? "many" : "one";
    const std::string name = "bench_libpq_" + kind;
    stores.Make(name);
    {
      const std::unique_ptr<ChildServer> server = stores.Start(kind, name);
      const auto channel = ConnectAlone(server->address());
      MakeBallHull(*v1::HullService::NewStub(channel), kHull, kVertices, 1);
      GrowingWriter writer(channel, kHull, "bench");
      for (int i = 0; i < 5; ++i) writer.SendAndReceive();
    }
    floors.push_back(std::make_unique<LibpqFloor>(stores.Conninfo(name), kHull, shared));
    LibpqFloor* const floor = floors.back().get();
    subjects.push_back(
        {.name = "libpq as " + kind, .run = [=] { return timed([=] { floor->Commit(); }); }});
    add_server(kind, stores.StartEmpty(kind));
  }
  add_server("shard", stores.StartEmpty("shard"));
  add_server("rocksdb", stores.StartEmpty("rocksdb"));
  add_server("gRPC alone", stores.StartFloor());
  // Both floors, one after the other: what a commit over the network cannot go below.
  GrowingWriter* const network = writers.back().get();
  for (const std::string kind : {"one", "many"}) {
    LibpqFloor* const floor = floors[kind == "one" ? 0 : 1].get();
    subjects.push_back({.name = "gRPC and libpq as " + kind, .run = [=] {
                          return timed([=] {
                            network->SendAndReceive();
                            floor->Commit();
                          });
                        }});
  }
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects,
         {{"one", "libpq as one"},
          {"many", "libpq as many"},
          {"shard", "many"},
          {"gRPC and libpq as one", "libpq as one"},
          {"gRPC and libpq as many", "libpq as many"}});
}

// One client: its connection, and the questions that it asks in turn.
struct Asker {
  std::unique_ptr<v1::CollisionService::Stub> stub;
  std::vector<v1::CheckCollisionRequest> requests;
  size_t next = 0;
};

constexpr int kQuestionHulls = 16;
std::string QuestionHull(uint64_t i) { return "questions/" + std::to_string(i % kQuestionHulls); }

Asker MakeAsker(const std::string& address, bool bounded, int seed) {
  Asker asker;
  asker.stub = v1::CollisionService::NewStub(ConnectAlone(address));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr int kRequests = 256;
  // About one pair in three collides.
  constexpr double kHalfRoom = 1.3;
  for (int i = 0; i < kRequests; ++i) {
    v1::CheckCollisionRequest& request = asker.requests.emplace_back();
    for (v1::Placement* placement : {request.mutable_a(), request.mutable_b()}) {
      placement->set_hull_id(QuestionHull(random()));
      v1::Quaternion* const q = placement->mutable_pose()->mutable_rotation();
      q->set_w(1.5 + unit(random));
      q->set_x(unit(random));
      q->set_y(unit(random));
      q->set_z(unit(random));
      v1::Vector3* const t = placement->mutable_pose()->mutable_translation();
      t->set_x(kHalfRoom * unit(random));
      t->set_y(kHalfRoom * unit(random));
      t->set_z(kHalfRoom * unit(random));
    }
    constexpr int kBoundNanoseconds = 200'000'000;
    if (bounded) request.mutable_freshness()->mutable_max_staleness()->set_nanos(kBoundNanoseconds);
  }
  return asker;
}

// All askers at once, for a while.
std::vector<double> AskAll(std::vector<Asker>& askers, double seconds) {
  std::vector<std::vector<double>> taken(askers.size());
  std::vector<std::thread> threads;
  const Clock::time_point begin = Clock::now();
  for (size_t i = 0; i < askers.size(); ++i) {
    threads.emplace_back([&, i] {
      Asker& asker = askers[i];
      while (Since(begin) < seconds) {
        grpc::ClientContext context;
        // Many connect at once.
        context.set_wait_for_ready(true);
        context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
        v1::CheckCollisionResponse response;
        const Clock::time_point start = Clock::now();
        Require(asker.stub->CheckCollision(
                    &context, asker.requests[asker.next++ % asker.requests.size()], &response),
                "CheckCollision");
        taken[i].push_back(1e6 * Since(start));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::vector<double> all = {};
  for (const std::vector<double>& each : taken) all.insert(all.end(), each.begin(), each.end());
  return all;
}

void MeasureQuestions(const Arguments& arguments) {
  const double each = arguments.clients == 1 ? 0.5 : 1;
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<std::unique_ptr<std::vector<Asker>>> askers;
  std::vector<Subject> subjects;
  std::map<std::string, std::string> peer_of;
  for (const std::string kind : {"rocksdb", "one", "many", "shard", "gRPC alone"}) {
    const bool is_floor = kind == "gRPC alone";
    servers.push_back(is_floor ? stores.StartFloor() : stores.StartEmpty(kind));
    const ChildServer& server = *servers.back();
    const auto hulls = v1::HullService::NewStub(ConnectAlone(server.address()));
    for (int i = 0; i < kQuestionHulls && !is_floor; ++i) {
      MakeBallHull(*hulls, QuestionHull(i), kVertices, 1);
    }
    for (const bool bounded : {true, false}) {
      if (!bounded && (is_floor || kind == "one")) continue;
      askers.push_back(std::make_unique<std::vector<Asker>>());
      std::vector<Asker>* const all = askers.back().get();
      for (int i = 0; i < arguments.clients; ++i) {
        all->push_back(MakeAsker(server.address(), bounded, i));
      }
      AskAll(*all, 0.5);
      const std::string name = is_floor ? kind : kind + (bounded ? " bounded" : " linearizable");
      peer_of[name] = bounded ? "rocksdb bounded" : "rocksdb linearizable";
      subjects.push_back(
          {.name = name, .pid = server.pid(), .run = [=] { return AskAll(*all, each); }});
    }
  }
  // The read index of many, without hulld.
  const std::string name = "bench_libpq_questions";
  stores.Make(name);
  {
    const std::unique_ptr<ChildServer> server = stores.Start("many", name);
    const auto channel = ConnectAlone(server->address());
    MakeBallHull(*v1::HullService::NewStub(channel), kHull, kVertices, 1);
    GrowingWriter writer(channel, kHull, "bench");
    for (int i = 0; i < 5; ++i) writer.SendAndReceive();
  }
  LibpqFloor floor(stores.Conninfo(name), kHull, true);
  if (arguments.clients == 1) {
    subjects.push_back({.name = "libpq question", .run = [&] {
                          std::vector<double> taken;
                          const Clock::time_point begin = Clock::now();
                          while (Since(begin) < each) {
                            const Clock::time_point start = Clock::now();
                            floor.Follow();
                            taken.push_back(1e6 * Since(start));
                          }
                          return taken;
                        }});
  }
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects, peer_of);
}

void MeasureBounded(const Arguments& arguments) {
  constexpr double kTurn = 0.25;
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<std::unique_ptr<std::vector<Asker>>> askers;
  std::vector<Subject> subjects;
  std::map<std::string, std::string> peer_of;
  for (const std::string name : {"rocksdb", "rocksdb again", "one", "many", "shard"}) {
    if (name == "rocksdb again") {
      std::filesystem::remove_all(arguments.folder + "/bench_again");
      servers.push_back(stores.Start("rocksdb", "bench_again"));
    } else {
      servers.push_back(stores.StartEmpty(name));
    }
    const ChildServer& server = *servers.back();
    const auto hulls = v1::HullService::NewStub(ConnectAlone(server.address()));
    for (int i = 0; i < kQuestionHulls; ++i) MakeBallHull(*hulls, QuestionHull(i), kVertices, 1);
    askers.push_back(std::make_unique<std::vector<Asker>>());
    std::vector<Asker>* const all = askers.back().get();
    for (int i = 0; i < arguments.clients; ++i) {
      all->push_back(MakeAsker(server.address(), true, i));
    }
    AskAll(*all, 0.5);
    peer_of[name] = "rocksdb";
    subjects.push_back(
        {.name = name, .pid = server.pid(), .run = [=] { return AskAll(*all, kTurn); }});
  }
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects, peer_of);
}

// Points in a ball of radius 1, in chunks of about 1 MiB.
std::vector<v1::AppendPointsRequest> MakeBall(int points) {
  constexpr int kPointsPerChunk = (1 << 20) / 24;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<v1::AppendPointsRequest> chunks;
  for (int i = 0; i < points;) {
    const double p[] = {unit(random), unit(random), unit(random)};
    if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 1) continue;
    if (i++ % kPointsPerChunk == 0) {
      chunks.emplace_back().mutable_chunk()->set_sequence(chunks.size());
    }
    for (const double x : p) chunks.back().mutable_chunk()->mutable_points()->add_xyz(x);
  }
  return chunks;
}

void MeasureIngest(const Arguments& arguments) {
  constexpr int kPoints = 4'000'000;
  const std::vector<v1::AppendPointsRequest> chunks = MakeBall(kPoints);
  const Stores stores(arguments);
  std::vector<std::unique_ptr<ChildServer>> servers;
  std::vector<Subject> subjects;
  for (const std::string kind : {"rocksdb", "one", "many", "shard"}) {
    servers.push_back(stores.StartEmpty(kind));
    const auto stub = std::make_shared<std::unique_ptr<v1::HullService::Stub>>(
        v1::HullService::NewStub(ConnectAlone(servers.back()->address())));
    const auto round = std::make_shared<int>(0);
    const auto run = [&chunks, stub, round] {
      const Clock::time_point start = Clock::now();
      grpc::ClientContext context;
      const auto stream = (*stub)->AppendPoints(&context);
      v1::AppendPointsRequest open;
      open.mutable_open()->set_hull_id("ingest/" + std::to_string(++*round));
      open.mutable_open()->set_create_if_absent(true);
      stream->Write(open);
      std::thread reader([&] {
        v1::AppendPointsResponse reply;
        while (stream->Read(&reply)) {
        }
      });
      for (const v1::AppendPointsRequest& chunk : chunks) stream->Write(chunk);
      stream->WritesDone();
      reader.join();
      Require(stream->Finish(), "AppendPoints");
      // Of a point, in the place of a request.
      return std::vector<double>(1, 1e6 * Since(start) / kPoints);
    };
    subjects.push_back({.name = kind, .pid = servers.back()->pid(), .run = run});
  }
  RunRounds(subjects, arguments.seconds);
  for (Subject& subject : subjects) {
    for (std::vector<double>* each : {&subject.rate}) {
      for (double& value : *each) value *= kPoints;
    }
    for (std::vector<double>* each : {&subject.cpu_us, &subject.database_cpu_us}) {
      for (double& value : *each) value /= kPoints;
    }
  }
  std::FILE* const out = arguments.out.empty() ? stdout : std::fopen(arguments.out.c_str(), "w");
  if (out == nullptr) Fail("cannot write " + arguments.out);
  std::fprintf(out,
               "server,points,per_second,least_per_second,cpu_us,database_cpu_us,rounds,load,"
               "compiler,cpu\n");
  for (const Subject& subject : subjects) {
    std::fprintf(out, "%s,%d,%.0f,%.0f,%.4f,%.4f,%zu,%.1f,%s,%s\n", subject.name.c_str(), kPoints,
                 Median(subject.rate), std::ranges::min(subject.rate), Median(subject.cpu_us),
                 Mean(subject.database_cpu_us), subject.rate.size(), LoadAverage(),
                 CompilerName().c_str(), CpuName().c_str());
  }
  if (out != stdout) std::fclose(out);
}

constexpr char kStartDatabase[] = "bench_start";
std::string StartHull(int i) { return "start/" + std::to_string(i); }

void Fill(const Arguments& arguments) {
  // So that the store commits many hulls at once.
  constexpr int kWriters = 64;
  const Stores stores(arguments);
  if (arguments.from == 0) stores.Make(kStartDatabase);
  const std::unique_ptr<ChildServer> server = stores.Start("many", kStartDatabase);
  const double used = ProcessorSeconds(server->pid());
  const double database = DatabaseSeconds();
  const Clock::time_point start = Clock::now();
  std::atomic<int> next = arguments.from;
  std::vector<std::thread> writers;
  for (int i = 0; i < kWriters; ++i) {
    writers.emplace_back([&] {
      const auto stub = v1::HullService::NewStub(ConnectAlone(server->address()));
      for (int hull = next++; hull < arguments.hulls && Since(start) < arguments.seconds;
           hull = next++) {
        MakeBallHull(*stub, StartHull(hull), kVertices, 1 + 1e-6 * hull);
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  const double count = std::min<int>(next - kWriters, arguments.hulls) - arguments.from;
  std::printf("hulls %d to %.0f: %.0f/s, %.0f us of hulld and %.0f us of the database each\n",
              arguments.from, arguments.from + count, count / Since(start),
              1e6 * (ProcessorSeconds(server->pid()) - used) / count,
              1e6 * (DatabaseSeconds() - database) / count);
  AskDatabase(stores.Conninfo(kStartDatabase), "CHECKPOINT");
}

double ResidentMebibytes(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/statm");
  double total = 0;
  double resident = 0;
  status >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

void MeasureStarts(const Arguments& arguments) {
  constexpr int kStarts = 5;
  const Stores stores(arguments);
  const auto ask = [&](const char* statement) {
    return AskDatabase(stores.Conninfo(kStartDatabase), statement);
  };
  const double hulls = std::stod(ask("SELECT count(*) FROM hulld.hulls"));
  std::vector<double> listens, answers, resident, cpu;
  for (int i = 0; i < kStarts; ++i) {
    const Clock::time_point start = Clock::now();
    const std::unique_ptr<ChildServer> server = stores.Start("many", kStartDatabase);
    listens.push_back(1e3 * Since(start));
    const auto stub = v1::CollisionService::NewStub(ConnectAlone(server->address()));
    grpc::ClientContext context;
    v1::CheckCollisionRequest request;
    v1::CheckCollisionResponse response;
    request.mutable_a()->set_hull_id(StartHull(0));
    request.mutable_b()->set_hull_id(StartHull(static_cast<int>(hulls) - 1));
    Require(stub->CheckCollision(&context, request, &response), "CheckCollision");
    answers.push_back(1e3 * Since(start));
    resident.push_back(ResidentMebibytes(server->pid()));
    cpu.push_back(1e3 * ProcessorSeconds(server->pid()));
  }
  const double bytes = std::stod(ask("SELECT pg_database_size(current_database())"));
  const bool is_new = arguments.out.empty() || !std::filesystem::exists(arguments.out);
  std::FILE* const out = arguments.out.empty() ? stdout : std::fopen(arguments.out.c_str(), "a");
  if (out == nullptr) Fail("cannot write " + arguments.out);
  if (is_new) {
    std::fprintf(out,
                 "hulls,vertices,listens_ms,answers_ms,resident_mib,cpu_ms,store_mib,load,"
                 "compiler,cpu\n");
  }
  std::fprintf(out, "%.0f,%d,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,%s,%s\n", hulls, kVertices,
               Median(listens), Median(answers), Median(resident), Median(cpu), bytes / (1 << 20),
               LoadAverage(), CompilerName().c_str(), CpuName().c_str());
  if (out != stdout) std::fclose(out);
}

void MeasureCold(const Arguments& arguments) {
  const Stores stores(arguments);
  const int hulls =
      std::stoi(AskDatabase(stores.Conninfo(kStartDatabase), "SELECT count(*) FROM hulld.hulls"));
  std::vector<int> order(hulls);
  for (int i = 0; i < hulls; ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937_64(1));
  const std::unique_ptr<ChildServer> server = stores.Start("many", kStartDatabase);
  std::vector<Asker> askers;
  for (int i = 0; i < arguments.clients; ++i) {
    askers.push_back(MakeAsker(server->address(), true, i));
  }
  // Each asker takes pairs of its own, of which none comes twice.
  std::vector<std::vector<double>> taken(askers.size());
  const auto ask = [&](size_t i, double seconds) {
    const Clock::time_point begin = Clock::now();
    Asker& asker = askers[i];
    while (Since(begin) < seconds) {
      const size_t pair = i + askers.size() * asker.next++;
      if (2 * pair + 1 >= order.size()) return;
      v1::CheckCollisionRequest request = asker.requests[pair % asker.requests.size()];
      request.mutable_a()->set_hull_id(StartHull(order[2 * pair]));
      request.mutable_b()->set_hull_id(StartHull(order[2 * pair + 1]));
      grpc::ClientContext context;
      v1::CheckCollisionResponse response;
      const Clock::time_point start = Clock::now();
      Require(asker.stub->CheckCollision(&context, request, &response), "CheckCollision");
      taken[i].push_back(1e6 * Since(start));
    }
  };
  Subject subject{.name = "many cold", .pid = server->pid(), .run = [&] {
                    std::vector<std::thread> threads;
                    for (std::vector<double>& each : taken) each.clear();
                    for (size_t i = 0; i < askers.size(); ++i) {
                      threads.emplace_back([&, i] { ask(i, arguments.seconds / 4); });
                    }
                    for (std::thread& thread : threads) thread.join();
                    std::vector<double> all;
                    for (const auto& each : taken) all.insert(all.end(), each.begin(), each.end());
                    return all;
                  }};
  const double before = ResidentMebibytes(server->pid());
  std::vector<Subject> subjects;
  subjects.push_back(std::move(subject));
  RunRounds(subjects, arguments.seconds);
  Report(arguments, subjects, {});
  const auto pairs = static_cast<double>(subjects[0].all.size());
  std::printf("%.0f bytes of memory a hull\n",
              (ResidentMebibytes(server->pid()) - before) * (1 << 20) / (2 * pairs));
}

int Run(int argc, char** argv) {
  Arguments arguments;
  const std::map<std::string, void (*)(const Arguments&)> suites = {
      {"commit", MeasureCommits}, {"questions", MeasureQuestions}, {"bounded", MeasureBounded},
      {"cold", MeasureCold},      {"ingest", MeasureIngest},       {"fill", Fill},
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
