// The database's disk is full: the disk of its tables, or that of its log.
#include <absl/strings/str_cat.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/server/harness/small_disk.h"
#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {
namespace postgres_disk_test {

using ::testing::HasSubstr;

// The parameter: several servers share the database.
class PostgresDisk : public ::testing::TestWithParam<bool> {
 protected:
  using Server = std::unique_ptr<PostgresRegistry>;

  // A database with its log on one small disk and its tablespace "small" on another.
  struct Machine {
    Machine() {
      for (const SmallDisk* disk : {&log, &tables})
        PostgresCluster::GiveToServer(disk->directory());
    }

    SmallDisk log{128};
    SmallDisk tables{64};
    std::unique_ptr<PostgresCluster> cluster;
  };

  static void SetUpTestSuite() {
    if (!PostgresCluster::IsInstalled()) return;
    machine_ = new Machine;
    if (!machine_->log.is_mounted() || !machine_->tables.is_mounted()) return;
    machine_->cluster =
        std::make_unique<PostgresCluster>(PostgresCluster::WalIn{machine_->log.directory()});
    cluster().RunSql("postgres", absl::StrCat("CREATE TABLESPACE small LOCATION '",
                                              machine_->tables.directory(), "'"));
  }
  static void TearDownTestSuite() { delete std::exchange(machine_, nullptr); }
  static PostgresCluster& cluster() { return *machine_->cluster; }

  void SetUp() override {
    if (machine_ == nullptr) GTEST_SKIP() << PostgresCluster::kMissing;
    if (machine_->cluster == nullptr) GTEST_SKIP() << SmallDisk::kNoMount;
  }
  void Start(const std::string& tablespace) {
    options_.conninfo = cluster().Conninfo(cluster().MakeDatabase(tablespace));
    options_.shared = GetParam();
    hulls_ = MakeServer();
    if (GetParam()) other_ = MakeServer();
  }
  Server MakeServer() const {
    absl::StatusOr<std::unique_ptr<PostgresStore>> store = PostgresStore::Open(options_);
    if (!store.ok()) {
      ADD_FAILURE() << store.status();
      std::abort();
    }
    return std::make_unique<PostgresRegistry>(*std::move(store));
  }
  // Servers end before the database does.
  void EndServers() {
    hulls_ = nullptr;
    other_ = nullptr;
  }
  // Returns the peer server, or this one after a restart.
  PostgresRegistry& Other() {
    if (GetParam()) return *other_;
    hulls_ = nullptr;
    hulls_ = MakeServer();
    return *hulls_;
  }
  static std::string Name(int i) { return absl::StrCat("h", i); }
  // A chunk of a thousand points that do not compress: the largest size.
  absl::Status PutNext() {
    std::uniform_real_distribution<double> angle(-1, 1);
    std::vector<Vector> points;
    for (int i = 0; i < 1000; ++i) {
      points.push_back(Vector(angle(random_), angle(random_), angle(random_)).normalized());
    }
    const absl::Status put = hulls_->Put(Name(acknowledged_), std::move(points)).status();
    if (put.ok()) ++acknowledged_;
    return put;
  }
  // Expects that every acknowledged change is stored and every refused one is not. Opening a
  // refused stream still creates its hull.
  void ExpectAcknowledged(PostgresRegistry& server) {
    for (int i = 0; i < acknowledged_; ++i) {
      const auto view = server.View(Name(i));
      ASSERT_TRUE(view.ok()) << view.status();
      EXPECT_EQ(view->record.counts.received, 1000);
    }
    const auto refused = server.View(Name(acknowledged_));
    if (refused.ok()) {
      EXPECT_EQ(refused->record.counts.received, 0);
    } else {
      EXPECT_TRUE(absl::IsNotFound(refused.status())) << refused.status();
    }
  }

  static Machine* machine_;
  PostgresOptions options_;
  Server hulls_;
  Server other_;
  std::mt19937_64 random_{1};
  int acknowledged_ = 0;
};

PostgresDisk::Machine* PostgresDisk::machine_ = nullptr;

INSTANTIATE_TEST_SUITE_P(Servers, PostgresDisk, ::testing::Bool(), [](const auto& shared) {
  return std::string(shared.param ? "Many" : "One");
});

TEST_P(PostgresDisk, AFullTablespaceIsReportedAndTheChangeRolledBack) {
  Start("small");
  ASSERT_TRUE(PutNext().ok());
  machine_->tables.Fill();
  absl::Status refused;
  for (int i = 0; i < 200 && refused.ok(); ++i) refused = PutNext();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("nothing was changed"));
  // Queries continue.
  ExpectAcknowledged(*hulls_);
  if (GetParam()) ExpectAcknowledged(*other_);
  machine_->tables.Free();
  const absl::Status put = PutNext();
  EXPECT_TRUE(put.ok()) << put;
  ExpectAcknowledged(Other());
  EndServers();
}

// PostgreSQL ends all its processes and recovers. If recovery needs space as well, it shuts down.
TEST_P(PostgresDisk, AFullLogDiskLosesNothing) {
  options_.retry_timeout = std::chrono::milliseconds(500);
  Start("pg_default");
  ASSERT_TRUE(PutNext().ok());
  machine_->log.Fill();
  absl::Status refused;
  for (int i = 0; i < 2000 && refused.ok(); ++i) refused = PutNext();
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  machine_->log.Free();
  cluster().StopImmediately();
  cluster().Start();
  // A change with an unknown outcome may or may not be stored.
  if (const auto last = Other().View(Name(acknowledged_));
      last.ok() && last->record.counts.received > 0) {
    ++acknowledged_;
  }
  ExpectAcknowledged(*hulls_);
  const absl::Status put = PutNext();
  EXPECT_TRUE(put.ok()) << put;
  ExpectAcknowledged(Other());
  EndServers();
}

}  // namespace postgres_disk_test
}  // namespace hulld::server
