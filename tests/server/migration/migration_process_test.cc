// Tests of the program: a server's store moves from RocksDB to PostgreSQL and back.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "tests/server/harness/hulld_process.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace migration_process_test {

using ::testing::HasSubstr;

using Words = std::vector<std::string>;

Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class MigrateProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    std::string name = ::testing::TempDir() + "hulld_migrate_XXXXXX";
    directory_ = mkdtemp(name.data());
    PostgresCluster& cluster = PostgresCluster::Shared();
    conninfo_ = cluster.WriteConninfo(cluster.MakeDatabase());
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  static std::unique_ptr<Process> Serve(const Words& store) {
    return std::make_unique<Process>(Words{"--listen", "127.0.0.1:0"} + store);
  }
  static Client Connect(Process& hulld) {
    ClientOptions options;
    options.server = AddressIn(hulld.ReadLineWith("listening on "));
    return Client(options);
  }
  static void End(Process& hulld) {
    hulld.Signal(SIGTERM);
    hulld.ReadToEnd();
    EXPECT_EQ(hulld.Wait(), 0);
  }
  // Returns the exit status and the error output.
  static std::pair<int, std::string> Migrate(const Words& options) {
    Process program(Words{"migrate"} + options);
    program.ReadToEnd();
    const int code = program.Wait();
    return {code, program.lines().empty() ? "" : program.lines().back()};
  }
  Words Directory(const std::string& name) const { return {directory_ + "/" + name}; }

  std::string directory_;
  std::string conninfo_;
};

TEST_F(MigrateProgram, ClientsContinueOnAMovedStore) {
  const Words on_rocksdb = Words{"--store", "rocksdb", "--data-dir"} + Directory("first");
  const Words on_postgres = {"--store", "postgres", "--postgres-conninfo-file", conninfo_};
  const Words to_postgres = Words{"--from-data-dir"} + Directory("first") +
                            Words{"--to-postgres-conninfo-file", conninfo_};
  AppendOptions writer;
  writer.writer_id = "w";
  writer.create_if_absent = true;
  uint64_t revision = 0;
  {
    const auto hulld = Serve(on_rocksdb);
    const Client client = Connect(*hulld);
    const auto appender = client.OpenAppend("h", writer);
    ASSERT_TRUE(appender.ok()) << appender.status();
    v1::PointBlock points;
    for (const double x : Cube()) points.add_xyz(x);
    ASSERT_TRUE((*appender)->Append(points).ok());
    ASSERT_TRUE((*appender)->Finish().ok());
    v1::PutBodyRequest body;
    body.set_body_id("body");
    body.add_pieces()->set_hull_id("h");
    ASSERT_TRUE(client.PutBody(body).ok());
    revision = client.GetHull("h")->header().revision();
    // A store open in a server is not migrated.
    const auto [code, error] = Migrate(to_postgres);
    EXPECT_EQ(code, 2);
    EXPECT_THAT(error, HasSubstr("is in use by another hulld"));
    End(*hulld);
  }
  EXPECT_EQ(Migrate(to_postgres), std::pair(0, std::string()));
  {
    const auto hulld = Serve(on_postgres);
    const Client client = Connect(*hulld);
    const auto hull = client.GetHull("h", /*audit=*/true);
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_TRUE(hull->audit().ok());
    EXPECT_EQ(hull->header().revision(), revision);
    EXPECT_EQ(client.GetBody("body")->pieces_size(), 1);
    // The writer continues with its sequence.
    const auto appender = client.OpenAppend("h", writer);
    ASSERT_TRUE(appender.ok()) << appender.status();
    v1::PointBlock points;
    for (const double x : {9., 9., 9.}) points.add_xyz(x);
    ASSERT_TRUE((*appender)->Append(points).ok());
    ASSERT_TRUE((*appender)->Finish().ok());
    EXPECT_EQ(client.GetHull("h")->hull().counts().received(), 9);
    const auto [code, error] = Migrate(
        Words{"--from-postgres-conninfo-file", conninfo_, "--to-data-dir"} + Directory("second"));
    EXPECT_EQ(code, 2);
    EXPECT_THAT(error, HasSubstr("a hulld is active on this database"));
    End(*hulld);
  }
  EXPECT_EQ(Migrate(Words{"--from-postgres-conninfo-file", conninfo_, "--to-data-dir"} +
                    Directory("second")),
            std::pair(0, std::string()));
  const auto hulld = Serve(Words{"--store", "rocksdb", "--data-dir"} + Directory("second"));
  const Client client = Connect(*hulld);
  EXPECT_TRUE(client.GetHull("h", /*audit=*/true)->audit().ok());
  EXPECT_EQ(client.GetHull("h")->hull().counts().received(), 9);
  EXPECT_EQ(client.GetBody("body")->pieces_size(), 1);
}

// After kill -9 at any time, the next run resumes the migration.
TEST_F(MigrateProgram, AKilledRunIsResumed) {
  {
    const auto hulld = Serve(Words{"--store", "rocksdb", "--data-dir"} + Directory("first"));
    const Client client = Connect(*hulld);
    for (int i = 0; i < 40; ++i) {
      AppendOptions writer;
      writer.create_if_absent = true;
      const auto appender = client.OpenAppend(absl::StrCat("h/", i), writer);
      ASSERT_TRUE(appender.ok());
      v1::PointBlock points;
      for (int k = 0; k < 3000; ++k) points.add_xyz((k * k * (i + 3)) % 1009);
      ASSERT_TRUE((*appender)->Append(points).ok());
      ASSERT_TRUE((*appender)->Finish().ok());
    }
    End(*hulld);
  }
  const Words options = Words{"--from-data-dir"} + Directory("first") +
                        Words{"--to-postgres-conninfo-file", conninfo_};
  for (int run = 0; run < 10; ++run) {
    Process program(Words{"migrate"} + options);
    // Later in each run.
    for (int spin = 0; spin < run * 300'000; ++spin) getpid();
    program.Signal(SIGKILL);
    program.Wait();
  }
  int code = 2;
  std::string error = "a hulld is active";
  // The database notices the end of the last run with a short delay. A completed migration is
  // refused.
  while (code == 2 && error.find("a hulld is active") != error.npos) {
    std::tie(code, error) = Migrate(options);
  }
  EXPECT_THAT(error, code == 0 ? HasSubstr("") : HasSubstr("the destination is not empty"));
  const auto hulld = Serve({"--store", "postgres", "--postgres-conninfo-file", conninfo_});
  const Client client = Connect(*hulld);
  const auto list = client.ListAllHulls("");
  ASSERT_TRUE(list.ok());
  EXPECT_EQ(list->hulls_size(), 40);
  for (const v1::HullInfo& hull : list->hulls()) {
    EXPECT_TRUE(client.GetHull(hull.hull_id(), /*audit=*/true)->audit().ok());
  }
}

}  // namespace migration_process_test
}  // namespace hulld::server
