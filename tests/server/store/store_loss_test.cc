// Write-ahead logs that lack acknowledged changes are refused before the database is opened.

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "server/admin/doctor.h"
#include "server/store/store_errors.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace store_loss_test {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class StoreLoss : public StoreTest {
 protected:
  // Creates each hull in a separate log, without a flush, and copies the store as a kill would
  // leave it.
  void PutInLogsOfTheirOwn(const std::vector<std::string>& hulls) {
    Start();
    rocksdb::DB& db = hulls_->store().db();
    ASSERT_TRUE(db.SetOptions({{"max_write_buffer_number", "8"}}).ok());
    ASSERT_TRUE(db.PauseBackgroundWork().ok());
    rocksdb::FlushOptions rotate;
    rotate.wait = false;
    rotate.allow_write_stall = true;
    for (const std::string& id : hulls) {
      if (id != hulls.front()) {
        ASSERT_TRUE(db.Flush(rotate).ok());
      }
      ASSERT_TRUE(hulls_->Put(id, CubeCorners()).ok());
    }
    store_id_ = hulls_->store().id();
    revision_ = hulls_->registry().Sizes().store_revision;
    fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
    ASSERT_TRUE(db.ContinueBackgroundWork().ok());
    hulls_ = nullptr;
  }
  std::string Left() const { return directory_ + "/left"; }
  std::vector<fs::path> Logs() const {
    std::vector<fs::path> logs;
    for (const auto& entry : fs::directory_iterator(Left() + "/rocksdb")) {
      if (entry.path().extension() == ".log") logs.push_back(entry.path());
    }
    std::ranges::sort(logs);
    return logs;
  }
  static std::string Read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  static void Write(const fs::path& path, const std::string& content) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
  }
  // Returns the contents of all files of the store.
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(Left())) {
      const std::string name = entry.path().filename();
      // RocksDB's diagnostic log is not part of the store.
      if (!entry.is_regular_file() || name.starts_with("LOG")) continue;
      files[entry.path()] = Read(entry.path());
    }
    return files;
  }

  // Expects that the store is refused unchanged, and served under a new ID after the loss is
  // accepted.
  void ExpectLoss(const std::string& finding) {
    const std::map<std::string, std::string> before = Files();
    for (int attempt = 0; attempt < 2; ++attempt) {
      const absl::Status refused = OpenStore("left").status();
      EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss) << refused;
      EXPECT_THAT(std::string(refused.message()),
                  AllOf(HasSubstr(finding), HasSubstr(absl::StrCat("revision ", revision_)),
                        HasSubstr("hulld doctor --accept-loss")));
    }
    EXPECT_EQ(Doctor({}), 1);
    EXPECT_EQ(Files(), before);
    EXPECT_EQ(Doctor({"--accept-loss"}), 0);
    for (int start = 0; start < 2; ++start) {
      const absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
      ASSERT_TRUE(store.ok()) << store.status();
      EXPECT_NE((*store)->id(), store_id_);
      EXPECT_LT((*store)->revision(), revision_);
    }
  }
  int Doctor(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--data-dir", Left()});
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const int status = RunDoctor(arguments);
    doctor_output_ = ::testing::internal::GetCapturedStdout();
    doctor_output_ += ::testing::internal::GetCapturedStderr();
    return status;
  }

  std::string store_id_;
  uint64_t revision_ = 0;
  std::string doctor_output_;
};

TEST_F(StoreLoss, AnIntactStoreIsAccepted) {
  PutInLogsOfTheirOwn({"a", "b", "c"});
  ASSERT_EQ(Logs().size(), 3);
  for (int start = 0; start < 2; ++start) {
    const absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
    ASSERT_TRUE(store.ok()) << store.status();
    EXPECT_EQ((*store)->id(), store_id_);
    EXPECT_EQ((*store)->revision(), revision_);
  }
  EXPECT_EQ(Doctor({"--accept-loss"}), 0);
  EXPECT_THAT(doctor_output_, HasSubstr(store_id_));
}

TEST_F(StoreLoss, ALogTruncatedWithinARecordIsRefused) {
  PutInLogsOfTheirOwn({"a"});
  fs::resize_file(Logs()[0], fs::file_size(Logs()[0]) - 10);
  ExpectLoss(" has ");
}

TEST_F(StoreLoss, ALogTruncatedBetweenRecordsIsRefused) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  fs::path log;
  for (const auto& entry : fs::directory_iterator(directory_ + "/data/rocksdb")) {
    if (entry.path().extension() == ".log") log = entry.path();
  }
  const uintmax_t end_of_record = fs::file_size(log);
  ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
  store_id_ = hulls_->store().id();
  revision_ = hulls_->registry().Sizes().store_revision;
  hulls_ = nullptr;
  fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
  fs::resize_file(Logs().back(), end_of_record);
  ExpectLoss(" has ");
}

TEST_F(StoreLoss, ALostChunkThatChangedNoVertexIsDetected) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  const uint64_t revision = hulls_->registry().Sizes().store_revision;
  hulls_ = nullptr;
  Start();
  ASSERT_TRUE(hulls_->Put("a", {{0.5, 0.5, 0.5}}).ok());
  ASSERT_EQ(hulls_->registry().Sizes().store_revision, revision);
  fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
  for (const fs::path& log : Logs()) fs::resize_file(log, 0);
  EXPECT_EQ(OpenStore("left").status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(StoreLoss, AMissingOnlyLogIsDetected) {
  PutInLogsOfTheirOwn({"a"});
  fs::remove(Logs()[0]);
  ExpectLoss("is missing");
}

TEST_F(StoreLoss, EachMissingLogIsDetected) {
  PutInLogsOfTheirOwn({"a", "b", "c"});
  const fs::path whole = directory_ + "/whole";
  fs::copy(Left(), whole, fs::copy_options::recursive);
  ASSERT_EQ(Logs().size(), 3);
  for (size_t lost = 1; lost < 8; ++lost) {
    SCOPED_TRACE(lost);
    fs::remove_all(Left());
    fs::copy(whole, Left(), fs::copy_options::recursive);
    const std::vector<fs::path> logs = Logs();
    for (size_t i = 0; i < logs.size(); ++i) {
      if ((lost >> i & 1) != 0) fs::remove(logs[i]);
    }
    ExpectLoss("is missing");
  }
}

// Logs after a gap are not replayed, so the store has the state at one revision.
TEST_F(StoreLoss, ATruncatedLogEndsTheHistoryBeforeLaterLogs) {
  PutInLogsOfTheirOwn({"a", "b", "c"});
  fs::resize_file(Logs()[1], 0);
  ExpectLoss("has 0 bytes");
  absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
  ASSERT_TRUE(store.ok()) << store.status();
  DurableRegistry hulls(*std::move(store));
  EXPECT_EQ(hulls.View("a")->record.vertex_count, 8);
  EXPECT_EQ(hulls.View("b").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(hulls.View("c").status().code(), absl::StatusCode::kNotFound);
}

// RocksDB interprets zeros as preallocated bytes.
TEST_F(StoreLoss, ALogEndingInZerosIsRefused) {
  PutInLogsOfTheirOwn({"a"});
  const std::string content = Read(Logs()[0]);
  Write(Logs()[0], std::string(content.size(), '\0'));
  ExpectLoss("differ from what was written");
}

TEST_F(StoreLoss, AnOlderCopyOfTheLogIsRefused) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  fs::copy(directory_ + "/data/rocksdb", directory_ + "/older", fs::copy_options::recursive);
  ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
  store_id_ = hulls_->store().id();
  revision_ = hulls_->registry().Sizes().store_revision;
  hulls_ = nullptr;
  for (const bool whole_database : {false, true}) {
    SCOPED_TRACE(whole_database);
    fs::remove_all(Left());
    fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
    if (whole_database) {
      fs::remove_all(Left() + "/rocksdb");
      fs::copy(directory_ + "/older", Left() + "/rocksdb");
    } else {
      const std::string name = Logs().back().filename();
      fs::copy_file(directory_ + "/older/" + name, Logs().back(),
                    fs::copy_options::overwrite_existing);
    }
    ExpectLoss(" has ");
  }
}

// The mark covers synced changes of a relaxed store as well.
TEST_F(StoreLoss, ARelaxedStoreDetectsMissingSyncedChanges) {
  durability_ = Durability::kRelaxed;
  sync_interval_ = std::chrono::hours(1);
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  store_id_ = hulls_->store().id();
  revision_ = hulls_->registry().Sizes().store_revision;
  hulls_ = nullptr;
  fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
  fs::remove(Logs().back());
  ExpectLoss("is missing");
}

TEST_F(StoreLoss, ALossIsFoundAfterManyStartsAndFlushes) {
  for (int start = 0; start < 3; ++start) {
    Start();
    ASSERT_TRUE(hulls_->Put(absl::StrCat("h", start), CubeCorners()).ok());
    ASSERT_TRUE(hulls_->store().db().Flush(rocksdb::FlushOptions()).ok());
    ASSERT_TRUE(hulls_->Put(absl::StrCat("late", start), CubeCorners()).ok());
  }
  store_id_ = hulls_->store().id();
  revision_ = hulls_->registry().Sizes().store_revision;
  hulls_ = nullptr;
  fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
  ASSERT_EQ(Logs().size(), 1);
  fs::remove(Logs()[0]);
  ExpectLoss("is missing");
}

// A store of an older hulld, or a copy of the database alone, has no mark and is accepted.
TEST_F(StoreLoss, AStoreWithoutAMarkGetsOne) {
  PutInLogsOfTheirOwn({"a"});
  fs::remove(Left() + "/hulld-log-mark");
  ASSERT_TRUE(OpenStore("left").ok());
  EXPECT_TRUE(fs::exists(Left() + "/hulld-log-mark"));
}

TEST_F(StoreLoss, ADamagedMarkIsRefused) {
  PutInLogsOfTheirOwn({"a"});
  const std::string mark = Left() + "/hulld-log-mark";
  Write(mark, std::string(Read(mark).size(), 'x'));
  const absl::Status refused = OpenStore("left").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr(mark));
  EXPECT_EQ(Doctor({"--accept-loss"}), 0);
  const absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_NE((*store)->id(), store_id_);
  EXPECT_EQ((*store)->revision(), revision_);
}

// Tables, which only the manifest names, and a log that contains later changes.
class ManifestLoss : public StoreLoss {
 protected:
  void SetUp() override {
    StoreLoss::SetUp();
    Start();
    ASSERT_TRUE(hulls_->Put("in_table", CubeCorners()).ok());
    // The next open moves the log into a table.
    for (const char* id : {"in_newer_table", "in_log"}) {
      hulls_ = nullptr;
      Start();
      ASSERT_TRUE(hulls_->Put(id, CubeCorners()).ok());
    }
    revision_ = hulls_->registry().Sizes().store_revision;
    fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
    hulls_ = nullptr;
    ASSERT_TRUE(fs::exists(Current()));
    std::string name = Read(Current());
    name.pop_back();
    manifest_ = Left() + "/rocksdb/" + name;
    ASSERT_TRUE(fs::exists(manifest_));
  }
  std::string Current() const { return Left() + "/rocksdb/CURRENT"; }

  // Expects that neither a server nor the doctor opens the store or changes it.
  void ExpectDamage(const std::string& finding, bool has_mark = true) {
    const std::map<std::string, std::string> before = Files();
    for (int attempt = 0; attempt < 2; ++attempt) {
      const absl::Status refused = OpenStore("left").status();
      EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss) << refused;
      EXPECT_THAT(std::string(refused.message()),
                  AllOf(HasSubstr(finding), HasSubstr("restore a backup")));
      EXPECT_THAT(std::string(refused.message()), Not(HasSubstr("--accept-loss")));
      if (has_mark) {
        EXPECT_THAT(std::string(refused.message()),
                    HasSubstr(absl::StrCat("revision ", revision_, " were acknowledged")));
      }
    }
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{}, {"--accept-loss"}}) {
      EXPECT_EQ(Doctor(arguments), 1);
      EXPECT_THAT(doctor_output_, HasSubstr(finding));
    }
    EXPECT_EQ(Files(), before);
  }

  fs::path manifest_;
};

TEST_F(ManifestLoss, AnIntactStoreIsAccepted) {
  for (int start = 0; start < 3; ++start) {
    const absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("left");
    ASSERT_TRUE(store.ok()) << store.status();
    EXPECT_EQ((*store)->revision(), revision_);
  }
}

// RocksDB would create an empty database in the directory, then replay the log and delete the
// tables.
TEST_F(ManifestLoss, AMissingCurrentIsRefused) {
  fs::remove(Current());
  ExpectDamage("the file CURRENT is missing");
  fs::remove(Left() + "/hulld-log-mark");
  ExpectDamage("the file CURRENT is missing", false);
}

TEST_F(ManifestLoss, ADamagedCurrentIsRefused) {
  for (const char* const content : {"", "\n", "MANIFEST-", "MANIFEST-000001", "junk\n"}) {
    Write(Current(), content);
    ExpectDamage("the file CURRENT is damaged");
  }
  Write(Current(), "MANIFEST-999999\n");
  ExpectDamage("the file MANIFEST-999999 is missing");
  Write(Current(), "MANIFEST-000001\n");
  ExpectDamage("the file CURRENT names MANIFEST-000001 instead of " +
               manifest_.filename().string());
}

TEST_F(ManifestLoss, AMissingManifestIsRefused) {
  fs::remove(manifest_);
  ExpectDamage(manifest_.filename().string() + " is missing");
}

// RocksDB takes a truncated manifest for one whose last record was never written.
TEST_F(ManifestLoss, AManifestTruncatedAnywhereIsRefused) {
  const std::string content = Read(manifest_);
  for (size_t size = 0; size < content.size(); ++size) {
    Write(manifest_, content.substr(0, size));
    const absl::Status refused = OpenStore("left").status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss) << size << ": " << refused;
  }
  Write(manifest_, content.substr(0, content.size() - 20));
  ExpectDamage(absl::StrCat(" has ", content.size() - 20, " bytes of ", content.size()));
}

TEST_F(ManifestLoss, AChangedManifestIsRefused) {
  const std::string content = Read(manifest_);
  std::string changed = content;
  changed[changed.size() / 2] ^= 1;
  Write(manifest_, changed);
  ExpectDamage("differ from what was written");
}

// A flush adds a record to the manifest of a running server.
TEST_F(ManifestLoss, AFlushOfARunningServerIsInTheMark) {
  fs::remove_all(Left());
  Start();
  ASSERT_TRUE(hulls_->store().db().Flush(rocksdb::FlushOptions()).ok());
  ASSERT_TRUE(hulls_->Put("later", CubeCorners()).ok());
  revision_ = hulls_->registry().Sizes().store_revision;
  fs::copy(directory_ + "/data", Left(), fs::copy_options::recursive);
  hulls_ = nullptr;
  std::string name = Read(Current());
  name.pop_back();
  manifest_ = Left() + "/rocksdb/" + name;
  const std::string content = Read(manifest_);
  Write(manifest_, content.substr(0, content.size() - 1));
  ExpectDamage(absl::StrCat(" has ", content.size() - 1, " bytes of ", content.size()));
}

TEST_F(ManifestLoss, AMissingTableIsRefused) {
  for (const auto& entry : fs::directory_iterator(Left() + "/rocksdb")) {
    if (entry.path().extension() == ".sst") fs::remove(entry.path());
  }
  EXPECT_EQ(OpenStore("left").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Doctor({"--accept-loss"}), 1);
  EXPECT_THAT(doctor_output_,
              AllOf(HasSubstr("restore a backup"), Not(HasSubstr("--accept-loss"))));
}

TEST_F(StoreLoss, TheDoctorRefusesAStoreThatAServerHasOpen) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{}, {"--accept-loss"}, {"--json"}}) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--data-dir", directory_ + "/data"});
    ::testing::internal::CaptureStderr();
    EXPECT_EQ(RunDoctor(all), 2);
    EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("is in use by another hulld"));
  }
  EXPECT_TRUE(hulls_->Put("a", CubeCorners(2)).ok());
  // The attempt did not release the lock of the server.
  EXPECT_EQ(OpenStore().status().code(), absl::StatusCode::kFailedPrecondition);
}

// A path that contains "lock", and a lock file that cannot be opened, say nothing about servers.
TEST_F(StoreLoss, OnlyALockThatIsHeldMeansThatAServerHasTheStoreOpen) {
  RocksDbOptions options;
  options.data_dir = directory_ + "/blocks.LOCK";
  fs::create_directories(options.data_dir + "/rocksdb/LOCK");
  const absl::Status unopened = RocksDbStore::Open(options).status();
  EXPECT_EQ(unopened.code(), absl::StatusCode::kUnavailable) << unopened;
  const absl::Status damaged = OpenError(
      rocksdb::Status::Corruption("bad block in " + options.data_dir), options.data_dir, false);
  EXPECT_EQ(damaged.code(), absl::StatusCode::kDataLoss) << damaged;
}

TEST_F(StoreLoss, AServerIsRefusedWhileTheDoctorRuns) {
  Start();
  hulls_ = nullptr;
  RocksDbOptions options;
  options.data_dir = directory_ + "/data";
  options.read_only = true;
  absl::StatusOr<std::unique_ptr<RocksDbStore>> looking = RocksDbStore::Open(options);
  ASSERT_TRUE(looking.ok()) << looking.status();
  EXPECT_EQ(OpenStore().status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(RocksDbStore::Open(options).status().code(), absl::StatusCode::kFailedPrecondition);
  *looking = nullptr;
  EXPECT_TRUE(OpenStore().ok());
}

}  // namespace store_loss_test
}  // namespace hulld::server
