#include "tests/server/harness/postgres/many_servers.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <utility>

#include "hulld/v1/hull.grpc.pb.h"
#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {
namespace {

// Pause between the polling reads of a client with an unanswered call, and their maximum number:
// one minute.
constexpr std::chrono::milliseconds kPause(5);
constexpr int kMaxQueries = 12'000;
constexpr std::chrono::milliseconds kWhile(200);

}  // namespace

void ManyServersTest::SetUp() {
  if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
}

ManyServersTest::Server::Server(const std::string& program, const std::string& conninfo_file) {
  const std::vector<std::string> words = {
      "--listen",    "127.0.0.1:0",        "--store", "postgres", "--postgres-conninfo-file",
      conninfo_file, "--postgres-servers", "many"};
  process = program.empty() ? std::make_unique<Process>(words)
                            : std::make_unique<Process>(program, words);
}

void ManyServersTest::Server::AwaitListening() {
  const std::string line = process->ReadLineWith("listening on ");
  if (line.empty()) {
    std::fprintf(stderr, "hulld ended with %d; it said:\n%s", process->Wait(),
                 absl::StrJoin(process->lines(), "").c_str());
    std::abort();
  }
  address = AddressIn(line);
  reader = std::thread([this] { process->ReadToEnd(); });
}

ManyServersTest::Server::~Server() {
  process->Signal(SIGKILL);
  process->Wait();
  if (reader.joinable()) reader.join();
}

void ManyServersTest::Begin(const std::vector<std::string>& conninfo_files) {
  servers_.clear();
  addresses_.clear();
  conninfo_files_ = conninfo_files;
  for (const std::string& file : conninfo_files_) {
    servers_.push_back(std::make_unique<Server>(program_, file));
    servers_.back()->AwaitListening();
    addresses_.push_back(servers_.back()->address);
  }
}

void ManyServersTest::BeginAtOnce(const std::vector<std::string>& conninfo_files) {
  servers_.clear();
  addresses_.clear();
  conninfo_files_ = conninfo_files;
  for (const std::string& file : conninfo_files_) {
    servers_.push_back(std::make_unique<Server>(program_, file));
  }
  for (const auto& server : servers_) {
    server->AwaitListening();
    addresses_.push_back(server->address);
  }
}

void ManyServersTest::Begin() {
  PostgresCluster& cluster = PostgresCluster::Shared();
  Begin(std::vector<std::string>(kServers, cluster.WriteConninfo(cluster.MakeDatabase())));
}

std::string ManyServersTest::address(size_t i) {
  const std::lock_guard lock(mutex_);
  return addresses_[i];
}

void ManyServersTest::Replace(size_t i) {
  servers_[i] = nullptr;
  servers_[i] = std::make_unique<Server>(program_, conninfo_files_[i]);
  servers_[i]->AwaitListening();
  const std::lock_guard lock(mutex_);
  addresses_[i] = servers_[i]->address;
}

std::shared_ptr<grpc::Channel> ManyServersTest::Connect(size_t server) {
  const std::lock_guard lock(mutex_);
  grpc::ChannelArguments own;
  own.SetInt("hulld.test.channel", ++channels_);
  return grpc::CreateCustomChannel(addresses_[server], grpc::InsecureChannelCredentials(), own);
}

void ManyServersTest::Call(size_t number, const Calls& calls, HullHistory& history,
                           const std::function<void()>& answered) {
  std::mt19937_64 random(100 * calls.seed + number);
  const size_t name = calls.share_writers ? number % (kClients / 2) : number;
  HistoryClient client(Connect(number % servers_.size()), history, absl::StrCat("client-", name),
                       100 * calls.seed + number);
  if (calls.any_freshness) client.ReadAtAnyFreshness();
  const auto move_on = [&] { client.Connect(Connect(random() % servers_.size())); };
  for (int call = 0; call < calls.each; ++call) {
    const std::string& hull = calls.hulls[call % 3 == 0 ? 0 : 1];
    const bool is_pair = calls.pairs && random() % 4 == 0;
    const bool is_body = !calls.bodies.empty() && random() % 3 == 0;
    const bool is_several = calls.several && random() % 4 == 0;
    const bool is_answered =
        is_several ? client.CallSeveralAtRandom(calls.hulls, calls.bodies)
        : is_body
            ? client.CallBodyAtRandom(calls.bodies[random() % calls.bodies.size()], calls.hulls)
        : is_pair ? client.Pair(calls.hulls[0], calls.hulls[1])
                  : client.CallAtRandom(hull);
    if (!is_answered) {
      // Polls with reads only, so that the history holds few changes of unknown outcome.
      int queries = 0;
      do {
        if (++queries == kMaxQueries) {
          ADD_FAILURE() << "no server answers client " << number << ", seed " << calls.seed;
          return answered();
        }
        std::this_thread::sleep_for(kPause);
        move_on();
      } while (!client.ReadAtRandom(hull));
    }
    if (random() % 5 == 0) move_on();
    answered();
  }
}

void ManyServersTest::Run(const Calls& calls, const std::vector<Fault>& faults,
                          HullHistory& history) {
  // No server reads an older state than this, so the probe always exists.
  for (size_t i = 0; i < servers_.size(); ++i) {
    HistoryClient(Connect(i), history, "probe", 0).MakeProbe();
  }
  std::atomic<size_t> made = 0;
  std::atomic<size_t> ended = 0;
  std::vector<std::thread> clients;
  for (size_t i = 0; i < kClients; ++i) {
    clients.emplace_back([&, i] {
      Call(i, calls, history, [&] {
        ++made;
        made.notify_one();
      });
      // All clients have ended; wakes every waiter.
      if (++ended == kClients) {
        made = kClients * static_cast<size_t>(calls.each);
        made.notify_one();
      }
    });
  }
  for (size_t fault = 0; fault < faults.size(); ++fault) {
    const size_t enough =
        kClients * static_cast<size_t>(calls.each) * (fault + 1) / (faults.size() + 1);
    for (size_t seen = made; seen < enough; seen = made) made.wait(seen);
    faults[fault]();
  }
  for (std::thread& client : clients) client.join();
  for (size_t i = 0; i < servers_.size(); ++i) {
    HistoryClient last(Connect(i), history, "last", i);
    for (const std::string& body : calls.bodies) {
      EXPECT_TRUE(last.GetBody(body)) << "server " << i << " does not answer, seed " << calls.seed;
      EXPECT_TRUE(last.QueryBody(body))
          << "server " << i << " does not answer, seed " << calls.seed;
    }
    if (calls.several) {
      EXPECT_TRUE(last.ListHulls(calls.hulls) && last.Batch(calls.hulls, calls.bodies))
          << "server " << i << " does not answer, seed " << calls.seed;
    }
    for (const std::string& hull : calls.hulls) {
      EXPECT_TRUE(last.Get(hull)) << "server " << i << " does not answer, seed " << calls.seed;
      EXPECT_TRUE(last.Mesh(hull)) << "server " << i << " does not answer, seed " << calls.seed;
    }
  }
}

void ManyServersTest::ExpectNoAnswer(size_t server, const std::string& hull_id) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kWhile);
  v1::CreateHullRequest request;
  v1::CreateHullResponse response;
  request.set_hull_id(hull_id);
  const auto stub = v1::HullService::NewStub(Connect(server));
  EXPECT_FALSE(stub->CreateHull(&context, request, &response).ok());
}

void ManyServersTest::ExpectLinearizable(const HullHistory& history, uint64_t seed) {
  const std::string fault = HistoryFault(history);
  if (fault.empty()) return;
  std::string said;
  for (const auto& each : servers_) {
    each->process->Signal(SIGKILL);
    if (each->reader.joinable()) each->reader.join();
    absl::StrAppend(&said, "a server said:\n", absl::StrJoin(each->process->lines(), ""));
  }
  ADD_FAILURE() << "seed " << seed << ": " << fault << "\n" << said;
}

}  // namespace hulld::server
