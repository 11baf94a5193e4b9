// hulld migrate to shards, between them and from them, killed again and again and gone on with.
//
// HULLD_KILLS: how many kills of each of the three; HULLD_TEST_SEED: the seed.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/postgres/cutting_proxy.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;
using Words = std::vector<std::string>;

constexpr int kHulls = 24;
constexpr int kBodies = 4;

uint64_t NumberIn(const char* variable, uint64_t otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// A store, or an empty place for one, as options of `hulld migrate` and of hulld name it.
struct Place {
  Words from;
  Words to;
  Words serve;
};

class ShardedMigration : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    std::string name = ::testing::TempDir() + "hulld_moved_XXXXXX";
    directory_ = mkdtemp(name.data());
    network_ = std::make_unique<CuttingProxy>(PostgresCluster::Shared().socket_directory());
    random_.seed(NumberIn("HULLD_TEST_SEED", 1));
  }
  void TearDown() override {
    if (!directory_.empty()) std::filesystem::remove_all(directory_);
  }

  Place NewDirectory() {
    const std::string path = absl::StrCat(directory_, "/data-", ++places_);
    return {{"--from-data-dir", path},
            {"--to-data-dir", path},
            {"--store", "rocksdb", "--data-dir", path}};
  }
  // Migrations go by network_, and servers do not. These name the shards in the other order.
  Place NewShards(const Words& slots) {
    PostgresCluster& cluster = PostgresCluster::Shared();
    const std::string path = absl::StrCat(directory_, "/", ++places_, ".shards");
    std::ofstream file(path);
    std::string swapped;
    for (const std::string& of_shard : slots) {
      const std::string database = cluster.MakeDatabase();
      file << of_shard << " " << cluster.WriteConninfo(database, network_->directory()) << "\n";
      swapped = absl::StrCat(of_shard, " ", cluster.WriteConninfo(database), "\n", swapped);
    }
    std::ofstream(path + ".swapped") << swapped;
    return {{"--from-postgres-shards", path},
            {"--to-postgres-shards", path},
            {"--store", "postgres", "--postgres-servers", "many", "--postgres-shards",
             path + ".swapped"}};
  }

  // A server over a place; nullptr where it ended and did not listen.
  struct Served {
    explicit Served(const Place& place)
        : process(std::make_unique<Process>(Words{"--listen", "127.0.0.1:0"} + place.serve)) {
      const std::string line = process->ReadLineWith("listening on ");
      if (!line.empty()) address = AddressIn(line);
    }
    Client Connect() const {
      ClientOptions options;
      options.server = address;
      return Client(options);
    }
    void End() {
      process->Signal(SIGTERM);
      process->ReadToEnd();
      EXPECT_EQ(process->Wait(), 0);
    }
    std::unique_ptr<Process> process;
    std::string address;
  };

  // Hulls that took points in two chunks of two writers, and bodies of some of them.
  static void Fill(const Place& place) {
    Served served(place);
    ASSERT_FALSE(served.address.empty());
    const Client client = served.Connect();
    std::mt19937_64 random(1);
    std::normal_distribution<double> coordinate;
    for (int i = 0; i < kHulls; ++i) {
      for (const char* const writer : {"v", "w"}) {
        AppendOptions options;
        options.create_if_absent = true;
        options.writer_id = writer;
        const auto appender = client.OpenAppend(absl::StrCat("h/", i), options);
        ASSERT_TRUE(appender.ok()) << appender.status();
        for (int chunk = 0; chunk < 2; ++chunk) {
          v1::PointBlock points;
          for (int k = 0; k < 3 * 200; ++k) points.add_xyz(coordinate(random));
          ASSERT_TRUE((*appender)->Append(points).ok());
        }
        ASSERT_TRUE((*appender)->Finish().ok());
      }
    }
    for (int i = 0; i < kBodies; ++i) {
      v1::PutBodyRequest body;
      body.set_body_id(absl::StrCat("b/", i));
      for (int k = i; k < kHulls; k += kBodies) {
        *body.add_pieces() = PlacementOf(absl::StrCat("h/", k), k, 0.1 * i, -k);
      }
      ASSERT_TRUE(client.PutBody(body).ok());
    }
    served.End();
  }

  // All that clients can see, by ID: what the store says of hulls and bodies, vertices and facets,
  // pieces, and the sequences of writers. Each hull is audited.
  static std::map<std::string, std::string> Describe(const Served& served) {
    std::map<std::string, std::string> described;
    const Client client = served.Connect();
    const auto stub = v1::HullService::NewStub(
        grpc::CreateChannel(served.address, grpc::InsecureChannelCredentials()));
    const auto hulls = client.ListAllHulls("");
    EXPECT_TRUE(hulls.ok()) << hulls.status();
    if (!hulls.ok()) return described;
    for (const v1::HullInfo& listed : hulls->hulls()) {
      const std::string& id = listed.hull_id();
      const auto hull = client.GetHull(id, /*audit=*/true);
      const auto mesh = client.GetHullMesh(id);
      EXPECT_TRUE(hull.ok() && hull->audit().ok()) << id;
      EXPECT_TRUE(mesh.ok()) << mesh.status();
      if (!hull.ok() || !mesh.ok()) continue;
      std::string& text = described[id];
      text = hull->hull().SerializeAsString();
      text.append(reinterpret_cast<const char*>(mesh->xyz.data()),
                  mesh->xyz.size() * sizeof(mesh->xyz[0]));
      for (const auto index : mesh->facet_indices) absl::StrAppend(&text, ",", index);
      for (const char* const writer : {"v", "w"}) {
        Appender appender(*stub, id, writer);
        EXPECT_TRUE(appender.is_open()) << id;
        absl::StrAppend(&text, "; ", writer, " ", appender.opened().last_sequence());
        EXPECT_TRUE(appender.Finish().ok()) << id;
      }
    }
    for (int i = 0; i < kBodies; ++i) {
      const std::string id = absl::StrCat("b/", i);
      const auto body = client.GetBody(id);
      if (!body.ok()) continue;
      std::string& text = described[id];
      text = body->body().SerializeAsString();
      for (const v1::Placement& piece : body->pieces()) text += piece.SerializeAsString();
    }
    return described;
  }
  void ExpectAll(const Place& place) {
    Served served(place);
    ASSERT_FALSE(served.address.empty());
    EXPECT_TRUE(Describe(served) == described_) << "what was copied is not what was there";
    served.End();
  }

  struct Outcome {
    bool was_killed = false;
    int code = 0;
    std::string said;
    uint64_t bytes = 0;
  };
  // A run that is killed once the databases have answered this many bytes.
  Outcome MigrateUpTo(uint64_t bytes, const Place& from, const Place& to) {
    Process program(Words{"migrate"} + from.from + to.to);
    const uint64_t before = network_->answered_bytes();
    std::atomic<bool> has_ended = false;
    std::thread reader([&] {
      program.ReadToEnd();
      has_ended = true;
    });
    while (!has_ended && network_->answered_bytes() - before < bytes) std::this_thread::yield();
    const bool is_killed = !has_ended;
    if (is_killed) program.Signal(SIGKILL);
    reader.join();
    const int code = program.Wait();
    return {is_killed && code == -1, code, program.lines().empty() ? "" : program.lines().back(),
            network_->answered_bytes() - before};
  }
  // The same as soon as the database sees that the one before is gone.
  Outcome MigrateNextUpTo(uint64_t bytes, const Place& from, const Place& to) {
    constexpr int kMost = 300;
    for (int attempt = 0; attempt < kMost; ++attempt) {
      const Outcome outcome = MigrateUpTo(bytes, from, to);
      if (outcome.said.find("a hulld is active") == std::string::npos) return outcome;
    }
    ADD_FAILURE() << "the database does not see that its client was killed";
    return {};
  }

  // At any time, also early, while little is answered, and late, when all that is left is to finish
  // one store after the other.
  uint64_t SomeMoment(uint64_t all) {
    const double part = std::uniform_real_distribution<double>()(random_);
    switch (random_() % 3) {
      case 0:
        return static_cast<uint64_t>(part * static_cast<double>(all));
      case 1:
        return static_cast<uint64_t>(std::pow(static_cast<double>(all), part));
      default:
        constexpr double kLate = 3000;
        return static_cast<uint64_t>(std::max(0., static_cast<double>(all) - part * kLate));
    }
  }

  // What clients find where a run was killed: all, nothing, or no server.
  void ExpectAllOrNothing(const Place& to) {
    Served served(to);
    if (served.address.empty()) {
      ++refused_;
      return;
    }
    const auto described = Describe(served);
    EXPECT_TRUE(described.empty() || described == described_)
        << "a server serves " << described.size() << " hulls and bodies of " << described_.size();
    served.process->Signal(SIGKILL);
    served.process->Wait();
  }

  // Moves to one new place after another until this many runs were killed; returns the last place.
  Place Move(const Place& from, const std::function<Place()>& make_destination) {
    const uint64_t kills = NumberIn("HULLD_KILLS", 3);
    Place to = make_destination();
    const Outcome whole = MigrateUpTo(UINT64_MAX, from, to);
    EXPECT_EQ(whole.code, 0) << whole.said;
    ExpectAll(to);
    for (uint64_t killed = 0; killed < kills && !HasFailure();) {
      to = make_destination();
      bool is_moved = false;
      bool was_killed = false;
      while (!is_moved && !HasFailure()) {
        const uint64_t moment = killed < kills ? SomeMoment(whole.bytes) : UINT64_MAX;
        const Outcome run = MigrateNextUpTo(moment, from, to);
        if (run.was_killed) {
          ++killed;
          ++killed_;
          was_killed = true;
          if (killed % 3 != 0) ExpectAllOrNothing(to);
          continue;
        }
        is_moved = true;
        // One that was killed when all was done.
        if (run.code == 2 && was_killed) {
          EXPECT_THAT(run.said, HasSubstr("the destination is not empty"));
        } else {
          EXPECT_EQ(run.code, 0) << run.said;
        }
      }
      ExpectAll(to);
    }
    return to;
  }

  std::string directory_;
  std::unique_ptr<CuttingProxy> network_;
  std::mt19937_64 random_;
  int places_ = 0;
  std::map<std::string, std::string> described_;
  uint64_t killed_ = 0;
  // Servers that did not start where a run was killed.
  uint64_t refused_ = 0;
};

TEST_F(ShardedMigration, AKilledRunIsGoneOnWithToShardsBetweenThemAndBack) {
  const Place first = NewDirectory();
  Fill(first);
  {
    Served served(first);
    described_ = Describe(served);
    ASSERT_EQ(described_.size(), size_t{kHulls + kBodies});
    served.End();
  }
  const Place two = Move(first, [this] { return NewShards({"0-511", "512-1023"}); });
  if (HasFailure()) return;
  const Place three = Move(two, [this] { return NewShards({"0-99", "100-799", "800-1023"}); });
  if (HasFailure()) return;
  Move(three, [this] { return NewDirectory(); });
  EXPECT_GT(refused_, 0U);
  RecordProperty("killed", std::to_string(killed_));
  RecordProperty("refused", std::to_string(refused_));
}

}  // namespace
}  // namespace hulld::server
