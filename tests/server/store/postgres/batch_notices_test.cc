#include "server/store/postgres/batch_notices.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <semaphore>

#include "server/store/postgres/session.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace {

// If set, a reader of an eventfd releases this semaphore first, then blocks until the eventfd is
// readable.
std::atomic<std::binary_semaphore*> reading = nullptr;

}  // namespace

// Replaces the C library's function.
extern "C" int eventfd_read(int fd, eventfd_t* value) {
  if (std::binary_semaphore* const semaphore = reading.exchange(nullptr); semaphore != nullptr) {
    semaphore->release();
    pollfd source = {fd, POLLIN, 0};
    poll(&source, 1, -1);
  }
  return read(fd, value, sizeof *value) == sizeof *value ? 0 : -1;
}

namespace hulld::server {
namespace batch_notices_test {

// The end arrives between the check for it and the reset of the eventfd. A thread that misses it
// blocks until the time limit of the test.
TEST(BatchNotices, EndDuringTheResetOfTheWakeup) {
  if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
  PostgresCluster& cluster = PostgresCluster::Shared();
  const std::string database = cluster.MakeDatabase();
  cluster.RunSql(database,
                 "CREATE SCHEMA hulld; CREATE TABLE hulld.store (batch bigint); "
                 "INSERT INTO hulld.store VALUES (7); GRANT USAGE ON SCHEMA hulld TO hulld; "
                 "GRANT SELECT ON hulld.store TO hulld");
  const absl::StatusOr<Conninfo> conninfo = ParseConninfo(cluster.Conninfo(database));
  ASSERT_TRUE(conninfo.ok());
  std::binary_semaphore is_reading{0};
  uint64_t heard = 0;
  auto notices = std::make_unique<BatchNotices>(
      [&] { return Session::Open(*conninfo, std::chrono::seconds(20)); },
      std::chrono::milliseconds(10),
      [&](uint64_t batch) {
        heard = batch;
        reading = &is_reading;
      },
      "it is not asked for");
  is_reading.acquire();
  notices = nullptr;
  EXPECT_EQ(heard, 7);
}

}  // namespace batch_notices_test
}  // namespace hulld::server
