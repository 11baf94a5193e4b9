// Servers over two databases of PostgreSQL, between which the hulls are spread.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "server/shards/slots.h"
#include "tests/server/harness/history/history_client.h"
#include "tests/server/harness/postgres/many_servers.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;
using Words = std::vector<std::string>;

// In the first and in the second half of the slots.
constexpr const char* kFirst = "shared/a";
constexpr const char* kSecond = "shared/c";

class ShardedServers : public ManyServersTest {
 protected:
  void SetUp() override {
    ManyServersTest::SetUp();
    if (IsSkipped()) return;
    ASSERT_LT(SlotOf(kFirst), kSlots / 2);
    ASSERT_GE(SlotOf(kSecond), kSlots / 2);
    std::string name = ::testing::TempDir() + "hulld_shards_XXXXXX";
    directory_ = mkdtemp(name.data());
    for (std::string& conninfo : conninfos_) conninfo = MakeConninfo();
    file_ = WriteShards("two", {{"0-511", conninfos_[0]}, {"512-1023", conninfos_[1]}});
  }
  void TearDown() override {
    if (!directory_.empty()) std::filesystem::remove_all(directory_);
  }

  static std::string MakeConninfo() {
    PostgresCluster& cluster = PostgresCluster::Shared();
    return cluster.WriteConninfo(cluster.MakeDatabase());
  }
  std::string WriteShards(const std::string& name,
                          const std::vector<std::pair<std::string, std::string>>& lines) const {
    const std::string path = directory_ + "/" + name + ".shards";
    std::ofstream file(path);
    for (const auto& [slots, conninfo] : lines) file << slots << " " << conninfo << "\n";
    return path;
  }
  Client ClientOf(size_t i) {
    ClientOptions options;
    options.server = address(i);
    return Client(options);
  }
  // What a program says that must end with 1 or 2 and not listen.
  static std::string ExpectRefused(const Words& words) {
    Process program(words);
    program.ReadToEnd();
    EXPECT_GT(program.Wait(), 0);
    std::string said;
    for (const std::string& line : program.lines()) said += line;
    EXPECT_THAT(said, Not(HasSubstr("listening on")));
    return said;
  }
  static std::string Refuse(const std::string& option, const std::string& file) {
    return ExpectRefused({"--listen", "127.0.0.1:0", "--store", "postgres", option, file,
                          "--postgres-servers", "many"});
  }
  // That a migration ends well; what it said.
  static void Migrate(const Words& options) {
    Words words = {"migrate"};
    words.insert(words.end(), options.begin(), options.end());
    Process program(words);
    program.ReadToEnd();
    const int code = program.Wait();
    EXPECT_EQ(code, 0) << (program.lines().empty() ? "" : program.lines().back());
  }
  static void PutCube(const Client& client, const std::string& id, double size) {
    AppendOptions options;
    options.create_if_absent = true;
    options.writer_id = "w";
    const auto stream = client.OpenAppend(id, options);
    ASSERT_TRUE(stream.ok()) << stream.status();
    v1::PointBlock points;
    for (const double coordinate : Cube(0, size)) points.add_xyz(coordinate);
    ASSERT_TRUE((*stream)->Append(points).ok());
    ASSERT_TRUE((*stream)->Finish().ok());
  }
  static v1::CheckCollisionRequest PairRequest() {
    v1::CheckCollisionRequest request;
    request.mutable_a()->set_hull_id(kFirst);
    request.mutable_b()->set_hull_id(kSecond);
    return request;
  }

  std::string directory_;
  std::string conninfos_[2];
  std::string file_;
};

TEST_F(ShardedServers, AreLinearizableAlsoForPairsOverTwoShards) {
  Begin(std::vector<std::string>(2, file_));
  HullHistory history;
  Run({.each = 60, .seed = 1, .hulls = {kFirst, kSecond}, .pairs = true}, {}, history);
  ExpectLinearizable(history, 1);
  size_t pairs = 0;
  for (const Operation& operation : history.operations().at(kFirst)) {
    pairs +=
        operation.kind == Operation::Kind::kPair && operation.outcome == Operation::Outcome::kOk;
  }
  EXPECT_GT(pairs, 10);
}

TEST_F(ShardedServers, AreSoWhenTheyAreKilled) {
  Begin({file_, file_});
  HullHistory history;
  const std::vector<Fault> faults = {[this] { Replace(0); }, [this] { Replace(1); }};
  Run({.each = 50, .seed = 2, .hulls = {kFirst, kSecond}, .pairs = true}, faults, history);
  ExpectLinearizable(history, 2);
}

TEST_F(ShardedServers, TellEachStoreAndItsRevision) {
  Begin({file_, file_});
  const Client clients[] = {ClientOf(0), ClientOf(1)};
  PutCube(clients[0], kFirst, 1);
  PutCube(clients[1], kSecond, 2);
  const auto checked = clients[0].CheckCollision(PairRequest());
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_EQ(checked->relation(), v1::RELATION_OVERLAPPING);
  const v1::ResponseHeader& header = checked->header();
  EXPECT_EQ(header.store_id(), "");
  ASSERT_EQ(header.shards_size(), 2);
  EXPECT_EQ(header.shards(0).store_id(), checked->hull_a().store_id());
  EXPECT_EQ(header.shards(1).store_id(), checked->hull_b().store_id());
  EXPECT_NE(checked->hull_a().store_id(), checked->hull_b().store_id());
  const auto status = clients[1].GetStatus();
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(status->header().shards_size(), 2);
  EXPECT_EQ(status->hull_count(), 2);
  // A call about one names one.
  const auto hull = clients[1].GetHull(kFirst, false);
  ASSERT_TRUE(hull.ok());
  EXPECT_EQ(hull->header().store_id(), header.shards(0).store_id());
  EXPECT_EQ(hull->header().shards_size(), 0);
  // What an answer was of is had from the other server, of both stores.
  v1::CheckCollisionRequest request = PairRequest();
  *request.mutable_freshness()->mutable_at_least() = header.shards();
  const auto again = clients[1].CheckCollision(request);
  ASSERT_TRUE(again.ok()) << again.status();
  request.mutable_freshness()->mutable_at_least(1)->set_revision(1000);
  EXPECT_TRUE(absl::IsFailedPrecondition(clients[1].CheckCollision(request).status()));
  request.mutable_freshness()->mutable_at_least(1)->set_store_id("another");
  EXPECT_TRUE(absl::IsFailedPrecondition(clients[1].CheckCollision(request).status()));
}

TEST_F(ShardedServers, ListAndWatchAreOfAllShards) {
  Begin({file_, file_});
  const Client clients[] = {ClientOf(0), ClientOf(1)};
  v1::WatchHullsRequest request;
  const auto watch = clients[1].WatchHulls(request);
  std::map<std::string, std::string> told;
  const auto read_until = [&](size_t count) {
    while (told.size() < count) {
      const auto message = watch->Next();
      ASSERT_TRUE(message.ok()) << message.status();
      EXPECT_EQ(message->header().shards_size(), 2);
      for (const v1::HullEvent& event : message->events()) {
        told[event.hull().hull_id()] = event.store_id();
      }
    }
  };
  for (int i = 0; i < 10; ++i) PutCube(clients[0], absl::StrCat("w", i), 1);
  read_until(10);
  // The client resumes after both revisions once its server is gone.
  const auto listed = clients[1].ListAllHulls("", 0);
  ASSERT_TRUE(listed.ok());
  ASSERT_EQ(listed->hulls_size(), 10);
  for (int i = 0; i < 10; ++i) {
    const std::string id = absl::StrCat("w", i);
    EXPECT_EQ(listed->hulls(i).hull_id(), id);
    const int shard = SlotOf(id) < kSlots / 2 ? 0 : 1;
    EXPECT_EQ(told[id], listed->header().shards(shard).store_id());
  }
}

TEST_F(ShardedServers, AServerWhoseFileSaysOtherwiseIsRefused) {
  Begin({file_});
  const std::string third = MakeConninfo();
  EXPECT_THAT(Refuse("--postgres-conninfo-file", conninfos_[0]),
              HasSubstr("holds slots 0-511: start hulld with the file that names them all"));
  EXPECT_THAT(Refuse("--postgres-shards", WriteShards("swapped", {{"0-511", conninfos_[1]},
                                                                  {"512-1023", conninfos_[0]}})),
              HasSubstr("holds slots 512-1023, and the file of --postgres-shards gives it 0-511"));
  EXPECT_THAT(
      Refuse("--postgres-shards", WriteShards("three", {{"0-511", conninfos_[0]},
                                                        {"512-1000", conninfos_[1]},
                                                        {"1001-1023", third}})),
      HasSubstr("holds slots 512-1023, and the file of --postgres-shards gives it 512-1000"));
  EXPECT_THAT(Refuse("--postgres-shards", WriteShards("hole", {{"0-511", conninfos_[0]}})),
              HasSubstr("no line names slot 512-1023"));
  const std::string away = conninfos_[1] + ".away";
  std::ofstream(away) << "host=/nowhere dbname=hulld";
  std::filesystem::permissions(away, std::filesystem::perms::owner_read);
  const std::string unreachable = Refuse(
      "--postgres-shards", WriteShards("away", {{"0-511", conninfos_[0]}, {"512-1023", away}}));
  EXPECT_THAT(unreachable, HasSubstr("--postgres-shards, " + away));
  EXPECT_THAT(unreachable, Not(HasSubstr("--postgres-conninfo-file")));
  // The server that is there was not disturbed.
  PutCube(ClientOf(0), kFirst, 1);
  PutCube(ClientOf(0), kSecond, 1);
}

TEST_F(ShardedServers, ADatabaseWithHullsOfAllSlotsIsNotTakenForAShard) {
  const std::string single = MakeConninfo();
  Begin({single});
  PutCube(ClientOf(0), kFirst, 1);
  EXPECT_THAT(Refuse("--postgres-shards",
                     WriteShards("taken", {{"0-511", single}, {"512-1023", MakeConninfo()}})),
              HasSubstr("holds hulls of all slots"));
  PutCube(ClientOf(0), kSecond, 1);
}

// A server that is active over an empty database with all slots is shut out by one that takes it as
// a shard.
TEST_F(ShardedServers, WhoKnowsNothingOfTheSlotsIsShutOut) {
  const std::string single = MakeConninfo();
  Begin({single, WriteShards("later", {{"0-511", single}, {"512-1023", conninfos_[1]}})});
  AppendOptions options;
  options.create_if_absent = true;
  EXPECT_FALSE(ClientOf(0).OpenAppend(kSecond, options).ok());
  PutCube(ClientOf(1), kSecond, 1);
}

TEST_F(ShardedServers, MoveFromOneDatabaseToTwoAndBack) {
  const std::string single = MakeConninfo();
  Begin({single});
  std::map<std::string, std::string> hulls;
  const auto describe = [](const Client& client, const std::string& id) {
    const auto hull = client.GetHull(id, true);
    const auto mesh = client.GetHullMesh(id);
    EXPECT_TRUE(hull.ok() && hull->audit().ok()) << id;
    EXPECT_TRUE(mesh.ok());
    return hull.ok() && mesh.ok() ? absl::StrCat(hull->hull().SerializeAsString(), mesh->xyz.size())
                                  : "";
  };
  for (int i = 0; i < 40; ++i) {
    const std::string id = absl::StrCat("moved/", i);
    PutCube(ClientOf(0), id, 1 + i);
    hulls[id] = describe(ClientOf(0), id);
  }
  v1::PutBodyRequest body;
  body.set_body_id("body");
  body.add_pieces()->set_hull_id("moved/0");
  body.add_pieces()->set_hull_id("moved/1");
  ASSERT_TRUE(ClientOf(0).PutBody(body).ok());
  const auto expect_all = [&] {
    const Client client = ClientOf(0);
    for (const auto& [id, described] : hulls) EXPECT_EQ(describe(client, id), described);
    const auto listed = client.ListAllHulls("", 0);
    ASSERT_TRUE(listed.ok());
    EXPECT_EQ(static_cast<size_t>(listed->hulls_size()), hulls.size());
    const auto found = client.GetBody("body");
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->pieces_size(), 2);
  };
  const auto end = [this] {
    server(0).Signal(SIGTERM);
    EXPECT_EQ(server(0).Wait(), 0);
    Begin(Words{});
  };
  end();
  Migrate({"--from-postgres-conninfo-file", single, "--to-postgres-shards", file_});
  Begin({file_});
  expect_all();
  // Revisions go on after all that were given.
  PutCube(ClientOf(0), "moved/later", 3);
  hulls["moved/later"] = describe(ClientOf(0), "moved/later");
  end();
  const std::string back = MakeConninfo();
  Migrate({"--from-postgres-shards", file_, "--to-postgres-conninfo-file", back});
  Begin({back});
  expect_all();
  end();
  // And to other shards.
  const std::string other = WriteShards(
      "other",
      {{"0-99", MakeConninfo()}, {"100-799", MakeConninfo()}, {"800-1023", MakeConninfo()}});
  Migrate({"--from-postgres-shards", file_, "--to-postgres-shards", other});
  Begin({other});
  expect_all();
  end();
  // What is there already is not overwritten.
  Process refused(
      {"migrate", "--from-postgres-conninfo-file", single, "--to-postgres-shards", file_});
  refused.ReadToEnd();
  EXPECT_EQ(refused.Wait(), 2);
}

}  // namespace
}  // namespace hulld::server
