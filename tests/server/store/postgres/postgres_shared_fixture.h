#ifndef HULLD_TESTS_SERVER_STORE_POSTGRES_POSTGRES_SHARED_FIXTURE_H_
#define HULLD_TESTS_SERVER_STORE_POSTGRES_POSTGRES_SHARED_FIXTURE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "tests/server/store/postgres/postgres_fixture.h"

namespace hulld::server {

// Several servers that are active simultaneously over one database, the first of them behind a
// proxy that can fail.
class PostgresSharedTest : public PostgresTest {
 protected:
  using Server = std::unique_ptr<PostgresRegistry>;

  void SetUp() override {
    PostgresTest::SetUp();
    options_.shared = true;
  }
  void TearDown() override {
    if (proxy_ != nullptr) proxy_->SetDown(false);
    PostgresTest::TearDown();
  }

  // Starts a server that bypasses the proxy.
  Server StartPeer() {
    PostgresOptions through_proxy = options_;
    options_.conninfo = cluster().Conninfo(database_, cluster().socket_directory());
    Server server = MakeRegistry();
    options_ = through_proxy;
    return server;
  }
  static uint64_t Received(PostgresRegistry& server, const std::string& id) {
    const auto view = server.View(id);
    return view.ok() ? view->record.counts.received : 0;
  }
  static absl::StatusOr<PutHullResult> Replace(PostgresRegistry& server, const std::string& id,
                                               const std::vector<Vector>& points,
                                               std::optional<uint64_t> if_revision = {}) {
    auto builder = std::make_shared<HullBuilder>();
    const auto counts = builder->Add(points, {});
    return server.Replace({id, if_revision, true, builder, *counts});
  }
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_STORE_POSTGRES_POSTGRES_SHARED_FIXTURE_H_
