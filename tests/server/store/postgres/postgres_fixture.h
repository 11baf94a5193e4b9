#ifndef HULLD_TESTS_SERVER_STORE_POSTGRES_POSTGRES_FIXTURE_H_
#define HULLD_TESTS_SERVER_STORE_POSTGRES_POSTGRES_FIXTURE_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/postgres/postgres_store.h"
#include "tests/server/harness/postgres/cutting_proxy.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {

using PostgresRegistry = TestRegistry<PostgresStore>;

// A separate database for each test, behind a proxy that can fail.
class PostgresTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
    database_ = cluster().MakeDatabase();
    proxy_ = std::make_unique<CuttingProxy>(cluster().socket_directory());
    options_.conninfo = cluster().Conninfo(database_, proxy_->directory());
  }
  void TearDown() override { hulls_ = nullptr; }

  static PostgresCluster& cluster() { return PostgresCluster::Shared(); }

  absl::StatusOr<std::unique_ptr<PostgresStore>> Open() { return PostgresStore::Open(options_); }
  // Opens the store, which must succeed, after closing the previous one.
  PostgresRegistry& Start() {
    hulls_ = nullptr;
    hulls_ = MakeRegistry();
    return *hulls_;
  }
  std::unique_ptr<PostgresRegistry> MakeRegistry() {
    absl::StatusOr<std::unique_ptr<PostgresStore>> store = Open();
    if (!store.ok()) {
      ADD_FAILURE() << store.status();
      std::abort();
    }
    auto hulls = std::make_unique<PostgresRegistry>(*std::move(store));
    EXPECT_TRUE(hulls->loaded().ok()) << hulls->loaded();
    return hulls;
  }
  // Restarts the server and returns the number of points that the hull has received.
  uint64_t ReceivedAfterRestart(const std::string& hull_id) {
    Start();
    const auto view = hulls_->View(hull_id);
    return view.ok() ? view->record.counts.received : 0;
  }
  std::vector<std::string> RunSql(const std::string& sql) const {
    return cluster().RunSql(database_, sql);
  }
  // Ends the sessions of hulld that satisfy `condition`.
  void EndSessions(const std::string& condition) const {
    RunSql(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = 'hulld' AND "
        "datname = current_database() AND " +
        condition);
  }

  std::string database_;
  std::unique_ptr<CuttingProxy> proxy_;
  PostgresOptions options_;
  std::unique_ptr<PostgresRegistry> hulls_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_STORE_POSTGRES_POSTGRES_FIXTURE_H_
