// Full disks: deletions succeed, and the server starts.

#include <absl/strings/str_cat.h>
#include <rocksdb/env.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "server/contract/errors.h"
#include "tests/server/harness/faulty_file_system.h"
#include "tests/server/harness/small_disk.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace store_room_test {

constexpr uint64_t kPlenty = uint64_t{1} << 40;
constexpr int kHulls = 40;

class StoreRoom : public StoreTest {
 protected:
  // The reserve is enough to write a log of 2 MB as a table.
  StoreRoom() {
    env_ = faulty_env_.get();
    reserve_bytes_ = 4 << 20;
  }
  ~StoreRoom() override { hulls_ = nullptr; }

  // 48 kB each.
  absl::Status PutNext() {
    const absl::Status put =
        hulls_->Put(absl::StrCat("h", hulls_put_), SpherePoints(2000)).status();
    if (put.ok()) ++hulls_put_;
    return put;
  }
  // Fills the disk except for the reserve.
  void FillDisk() {
    Start();
    for (int i = 0; i < kHulls; ++i) ASSERT_TRUE(PutNext().ok());
    files_->SetRoom(files_->used() + 4096);
    ExpectFull();
  }
  // A change of 1.4 MB is refused each time, without effect.
  void ExpectFull() {
    const uint64_t revision = hulls_->registry().Sizes().store_revision;
    for (int attempt = 0; attempt < 3; ++attempt) {
      auto large = std::make_shared<HullBuilder>();
      ASSERT_TRUE(large->Add(SpherePoints(60'000)).ok());
      const absl::Status refused = hulls_->Replace({"h1", {}, false, large, {}}).status();
      EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
      EXPECT_EQ(ReasonOf(refused), v1::ERROR_REASON_DISK_FULL);
    }
    EXPECT_EQ(hulls_->registry().Sizes().store_revision, revision);
    EXPECT_EQ(hulls_->View("h1")->record.vertex_count, 2000);
  }

  const std::shared_ptr<FaultyFileSystem> files_ = std::make_shared<FaultyFileSystem>();
  const std::unique_ptr<rocksdb::Env> faulty_env_ = rocksdb::NewCompositeEnv(files_);
  int hulls_put_ = 0;
};

TEST_F(StoreRoom, AFullDiskAcceptsOnlyDeletions) {
  FillDisk();
  ASSERT_TRUE(hulls_->Delete("h0").ok());
  EXPECT_EQ(hulls_->View("h0").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(hulls_->View("h1")->record.vertex_count, 2000);
  files_->SetRoom(kPlenty);
  ASSERT_TRUE(PutNext().ok());
  Start();
  EXPECT_EQ(hulls_->View("h0").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, kHulls);
}

TEST_F(StoreRoom, TheFirstDeletionAfterAFailedBackupSucceeds) {
  Start();
  for (int i = 0; i < kHulls; ++i) ASSERT_TRUE(PutNext().ok());
  files_->SetRoom(files_->used());
  ASSERT_FALSE(hulls_->store().MakeCopy().ok());
  const auto deleted = hulls_->Delete("h0");
  EXPECT_TRUE(deleted.ok()) << deleted.status();
}

TEST_F(StoreRoom, DeletionsMakeRoomForChanges) {
  FillDisk();
  for (int i = 1; i < kHulls; ++i) ASSERT_TRUE(hulls_->Delete(absl::StrCat("h", i)).ok()) << i;
  ASSERT_TRUE(PutNext().ok());
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, 2);
  Start();
  EXPECT_EQ(hulls_->registry().Sizes().hull_count, 2);
  ASSERT_TRUE(PutNext().ok());
}

TEST_F(StoreRoom, AServerStartsOnAFullDisk) {
  FillDisk();
  for (int start = 0; start < 3; ++start) {
    Start();
    ExpectFull();
    ASSERT_TRUE(hulls_->Delete(absl::StrCat("h", 2 + start)).ok());
    EXPECT_EQ(hulls_->registry().Sizes().hull_count, kHulls - 1 - start);
  }
  files_->SetRoom(kPlenty);
  ASSERT_TRUE(PutNext().ok());
}

// The reserve is too small to open the store for changes.
TEST_F(StoreRoom, AServerThatCannotWriteItsStoreAnswersQueries) {
  reserve_bytes_ = 4096;
  FillDisk();
  const std::string id = hulls_->store().id();
  hulls_ = nullptr;
  files_->SetRoom(files_->used());
  for (int start = 0; start < 2; ++start) {
    Start();
    EXPECT_EQ(hulls_->store().id(), id);
    ExpectFull();
    EXPECT_EQ(ReasonOf(hulls_->Delete("h0").status()), v1::ERROR_REASON_DISK_FULL);
  }
  files_->SetRoom(kPlenty);
  ASSERT_TRUE(PutNext().ok());
  ASSERT_TRUE(hulls_->Delete("h0").ok());
}

TEST_F(StoreRoom, ANewStoreIsRefusedOnAFullDisk) {
  files_->SetRoom(0);
  EXPECT_EQ(OpenStore().status().code(), absl::StatusCode::kResourceExhausted);
  files_->SetRoom(kPlenty);
  EXPECT_TRUE(OpenStore().ok());
}

// Uses the defaults, on a real file system.
TEST(SmallDiskRoom, AFullDiskAcceptsDeletionsAndAllowsAStart) {
  const SmallDisk disk(160);
  if (!disk.is_mounted()) GTEST_SKIP() << SmallDisk::kNoMount;
  std::unique_ptr<DurableRegistry> hulls;
  const auto start = [&] {
    hulls = nullptr;
    RocksDbOptions options;
    options.data_dir = disk.directory() + "/data";
    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = RocksDbStore::Open(options);
    ASSERT_TRUE(store.ok()) << store.status();
    hulls = std::make_unique<DurableRegistry>(*std::move(store));
    ASSERT_TRUE(hulls->loaded().ok());
  };
  start();
  int count = 0;
  const auto put = [&] {
    return hulls->Put(absl::StrCat("h", count), SpherePoints(20'000)).status();
  };
  for (; count < 20; ++count) ASSERT_TRUE(put().ok());
  for (int attempt = 0; attempt < 3; ++attempt) {
    // Preallocated bytes of the log have space for a few more changes.
    absl::Status refused;
    for (; refused.ok(); ++count) {
      disk.Fill();
      refused = put();
    }
    EXPECT_EQ(ReasonOf(refused), v1::ERROR_REASON_DISK_FULL) << refused;
  }
  ASSERT_TRUE(hulls->Delete("h0").ok());
  start();
  EXPECT_EQ(hulls->View("h1")->record.vertex_count, 20'000);
  for (int i = 1; i < 20; ++i) ASSERT_TRUE(hulls->Delete(absl::StrCat("h", i)).ok()) << i;
  disk.Free();
  EXPECT_TRUE(put().ok());
}

}  // namespace store_room_test
}  // namespace hulld::server
