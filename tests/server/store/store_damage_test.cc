// Damaged bytes of a store are detected, reported, and never served.

#include <absl/strings/str_cat.h>

#include <fstream>
#include <iterator>
#include <random>

#include "core/hull/audit.h"
#include "server/admin/doctor.h"
#include "server/store/store_keys.h"
#include "tests/server/harness/kept_store.h"
#include "tests/server/harness/store_fixture.h"
#include "tests/test_size.h"

namespace hulld::server {
namespace store_damage_test {

using ::testing::HasSubstr;

// Creates three hulls. Tests damage the second one.
template <typename Hulls>
void PutThree(Hulls& hulls) {
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(hulls.Put(id, CubeCorners()).ok());
}

class StoreDamage : public KeptStoreTest {
 protected:
  // Flips a bit of the value of `key`, like a faulty disk controller.
  void Flip(const std::string& key) {
    std::string value = kept_->Get(key);
    value[value.size() / 2] ^= 4;
    kept_->Put(key, value);
  }
  size_t CountKeys(char prefix) { return kept_->Count(prefix); }
  void FillThree() { PutThree(Start()); }
  void ExpectOnlyBIsDamaged() {
    const auto damaged = hulls_->View("b");
    EXPECT_EQ(damaged.status().code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(std::string(damaged.status().message()), HasSubstr("hull \"b\" is damaged"));
    EXPECT_EQ(hulls_->Put("b", CubeCorners(), "other").status().code(),
              absl::StatusCode::kDataLoss);
    for (const char* id : {"a", "c"}) {
      EXPECT_EQ(hulls_->View(id)->record.vertex_count, 8);
      EXPECT_TRUE(hulls_->Put(id, CubeCorners(2)).ok());
    }
    ASSERT_TRUE(hulls_->Delete("b").ok());
    EXPECT_TRUE(hulls_->Put("b", CubeCorners()).ok());
    EXPECT_EQ(hulls_->View("b")->record.vertex_count, 8);
  }
};

INSTANTIATE_TEST_SUITE_P(Kinds, StoreDamage, KeptStores(), KeptStoreName);

class RocksDbDamage : public StoreTest {
 protected:
  void FlipRecord(const std::string& hull_id) {
    std::string value;
    ASSERT_TRUE(hulls_->store().db().Get({}, HullKey(hull_id), &value).ok());
    value[value.size() / 2] ^= 4;
    ASSERT_TRUE(hulls_->store().db().Put({}, HullKey(hull_id), value).ok());
  }
  std::filesystem::path LogFile() const {
    std::filesystem::path log;
    for (const auto& entry : std::filesystem::directory_iterator(directory_ + "/data/rocksdb")) {
      if (entry.path().extension() == ".log") log = entry.path();
    }
    return log;
  }
  static void FlipBits(const std::filesystem::path& path, uintmax_t offset, int mask) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    const char byte = static_cast<char>(file.get() ^ mask);
    file.seekp(static_cast<std::streamoff>(offset));
    file.put(byte);
  }
  size_t CountKeys(char prefix) {
    const std::unique_ptr<rocksdb::Iterator> it(hulls_->store().db().NewIterator({}));
    size_t count = 0;
    for (it->Seek(std::string(1, prefix)); it->Valid() && it->key()[0] == prefix; it->Next()) {
      ++count;
    }
    return count;
  }
  void FillThree() { PutThree(Start()); }
};

TEST_P(StoreDamage, ADamagedDeltaIsReportedByHullAndNeverServed) {
  FillThree();
  const HullRecord record = hulls_->View("b")->record;
  Flip(DeltaKey(record.create_revision, record.revision));
  Start();
  ExpectOnlyBIsDamaged();
}

// One damaged hull does not affect the hulls that are read together with it.
TEST_P(StoreDamage, ADamagedDeltaAmongManyIsReportedByHull) {
  constexpr size_t kHulls = 40;
  constexpr size_t kDamaged = 17;
  Start();
  std::vector<std::string> ids;
  for (size_t i = 0; i < kHulls; ++i) {
    ids.push_back(absl::StrCat("h", i));
    ASSERT_TRUE(hulls_->Put(ids.back(), CubeCorners()).ok());
  }
  const HullRecord record = hulls_->View(ids[kDamaged])->record;
  Flip(DeltaKey(record.create_revision, record.revision));
  Start();
  const absl::StatusOr<Resolved> resolved = hulls_->registry().Resolve(ids, {});
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  for (size_t i = 0; i < kHulls; ++i) {
    const absl::StatusOr<HullView>& hull = resolved->hulls[i];
    EXPECT_EQ(absl::IsDataLoss(hull.status()), i == kDamaged) << hull.status();
    if (hull.ok()) {
      EXPECT_EQ(hull->record.vertex_count, 8);
    }
  }
  EXPECT_THAT(std::string(resolved->hulls[kDamaged].status().message()),
              HasSubstr(absl::StrCat("hull \"", ids[kDamaged], "\"")));
}

TEST_P(StoreDamage, ADamagedRecordIsReportedByHullAndListed) {
  FillThree();
  Flip(HullKey("b"));
  Start();
  const RecordPage page = hulls_->registry().records().List("", "", 10).value();
  ASSERT_EQ(page.entries.size(), 3);
  EXPECT_FALSE(page.entries[0].damaged);
  EXPECT_TRUE(page.entries[1].damaged);
  EXPECT_EQ(hulls_->Create("b", true).status().code(), absl::StatusCode::kDataLoss);
  ExpectOnlyBIsDamaged();
}

TEST_P(StoreDamage, DeletingADamagedHullLeavesNothingAfterARestart) {
  FillThree();
  ASSERT_TRUE(hulls_->Put("b", SpherePoints(40'000, 9)).ok());
  ASSERT_GT(CountKeys(kBasePrefix), 0);
  Flip(HullKey("b"));
  Start();
  ASSERT_TRUE(hulls_->Delete("b").ok());
  Start();
  EXPECT_EQ(CountKeys(kWriterPrefix), 2);
  EXPECT_EQ(CountKeys(kDeltaPrefix), 2);
  EXPECT_EQ(CountKeys(kBasePrefix), 0);
  for (const char* id : {"a", "c"}) EXPECT_EQ(hulls_->View(id)->record.vertex_count, 8);
  EXPECT_EQ(hulls_->Open("a", "w")->last_sequence, 1);
}

TEST_P(StoreDamage, ReplacingADamagedHullLeavesNothingAfterARestart) {
  FillThree();
  Flip(HullKey("b"));
  Start();
  auto builder = std::make_shared<HullBuilder>();
  ASSERT_TRUE(builder->Add(CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Replace({"b", {}, false, builder, {}}).ok());
  Start();
  EXPECT_EQ(CountKeys(kWriterPrefix), 2);
  EXPECT_EQ(CountKeys(kDeltaPrefix) + CountKeys(kBasePrefix), 3);
  for (const char* id : {"a", "b", "c"}) EXPECT_EQ(hulls_->View(id)->record.vertex_count, 8);
}

// Finding the remains of a damaged hull takes a scan of all records. A start scans, a deletion does
// not.
TEST_F(RocksDbDamage, DeletingADamagedHullReadsNoOtherRecord) {
  FillThree();
  FlipRecord("b");
  Start();
  ASSERT_TRUE(hulls_->Delete("b").ok());
  EXPECT_EQ(CountKeys(kWriterPrefix), 3);
  std::string mark;
  EXPECT_TRUE(hulls_->store().db().Get({}, kLostKey, &mark).ok());
  Start();
  EXPECT_EQ(CountKeys(kWriterPrefix), 2);
  EXPECT_TRUE(hulls_->store().db().Get({}, kLostKey, &mark).IsNotFound());
}

// With two such hulls, the owner of each key is unknown.
TEST_F(RocksDbDamage, KeysOfAnotherDamagedHullAreKeptUntilItIsDeletedToo) {
  FillThree();
  FlipRecord("a");
  FlipRecord("b");
  Start();
  ASSERT_TRUE(hulls_->Delete("b").ok());
  Start();
  EXPECT_EQ(CountKeys(kDeltaPrefix), 3);
  EXPECT_EQ(hulls_->View("a").status().code(), absl::StatusCode::kDataLoss);
  ASSERT_TRUE(hulls_->Delete("a").ok());
  Start();
  EXPECT_EQ(CountKeys(kDeltaPrefix), 1);
  EXPECT_EQ(CountKeys(kWriterPrefix), 1);
  EXPECT_EQ(hulls_->View("c")->record.vertex_count, 8);
}

TEST_F(RocksDbDamage, DoctorReportIsUtf8ForAnyKeys) {
  FillThree();
  ASSERT_TRUE(hulls_->store().db().Put({}, HullKey("x\xff\"\n"), "garbage").ok());
  hulls_ = nullptr;
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(RunDoctor({"--data-dir", directory_ + "/data", "--json"}), 1);
  const std::string report = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(report, HasSubstr(R"({"hullId":"x\ufffd\"\u000a")"));
}

TEST_P(StoreDamage, AMissingDeltaIsReported) {
  FillThree();
  const HullRecord record = hulls_->View("b")->record;
  kept_->Delete(DeltaKey(record.create_revision, record.revision));
  Start();
  ExpectOnlyBIsDamaged();
}

TEST_P(StoreDamage, AValueUnderAnotherKeyIsReported) {
  FillThree();
  const HullRecord a = hulls_->View("a")->record;
  const HullRecord b = hulls_->View("b")->record;
  kept_->Put(DeltaKey(b.create_revision, b.revision),
             kept_->Get(DeltaKey(a.create_revision, a.revision)));
  Start();
  ExpectOnlyBIsDamaged();
}

TEST_P(StoreDamage, AMissingPartOfABaseIsReported) {
  Start();
  ASSERT_TRUE(hulls_->Put("h", SpherePoints(40'000)).ok());
  const HullRecord record = hulls_->View("h")->record;
  kept_->Delete(BaseKey(record.create_revision, record.revision, 1));
  Start();
  EXPECT_THAT(std::string(hulls_->View("h").status().message()),
              HasSubstr("part 1 of its base: it is missing"));
}

TEST_P(StoreDamage, ADamagedSequenceIsDetected) {
  FillThree();
  Flip(WriterKey(hulls_->View("b")->record.create_revision, "w"));
  Start();
  const auto opened = hulls_->Open("b", "w");
  EXPECT_EQ(opened.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(opened.status().message()), HasSubstr("hull \"b\""));
  EXPECT_TRUE(hulls_->View("b").ok());
}

// Flips single bits in all files of a store. A store that opens serves the original hulls or
// reports damage.
TEST_F(RocksDbDamage, FlippedBitsInItsFilesAreNeverServed) {
  Start();
  const std::vector<Vector> sphere = SpherePoints(300);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(hulls_->Put(absl::StrCat("h", i), {sphere.begin() + i, sphere.end()}).ok());
  }
  const Hull expected = CanonicalOf(*hulls_->View("h7"));
  ASSERT_TRUE(hulls_->store().db().Flush({}).ok());
  ASSERT_TRUE(hulls_->Put("late", CubeCorners()).ok());
  hulls_ = nullptr;

  constexpr int kTrials = TestSize(120, 40);
  std::mt19937_64 random(20261121);
  int refused_to_open = 0;
  int reported = 0;
  int harmless = 0;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory_ + "/data/rocksdb")) {
    const std::string extension = entry.path().extension();
    if (extension == ".sst" || extension == ".log") files.push_back(entry.path());
  }
  ASSERT_GE(files.size(), 2);
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    const std::string copy = directory_ + "/copy";
    std::filesystem::remove_all(copy);
    std::filesystem::copy(directory_ + "/data", copy, std::filesystem::copy_options::recursive);
    const std::filesystem::path path =
        std::filesystem::path(copy) / "rocksdb" / files[trial % files.size()].filename();
    const uintmax_t offset = random() % std::filesystem::file_size(path);
    FlipBits(path, offset, 1 << random() % 8);

    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = OpenStore("copy");
    if (!store.ok()) {
      ++refused_to_open;
      continue;
    }
    DurableRegistry hulls(*std::move(store));
    bool damage = !hulls.loaded().ok();
    for (int i = 0; i < 20; ++i) {
      const std::string id = absl::StrCat("h", i);
      const auto view = hulls.View(id);
      if (!view.ok()) {
        damage = true;
        EXPECT_TRUE(absl::IsDataLoss(view.status()) ||
                    (absl::IsNotFound(view.status()) && !hulls.loaded().ok()))
            << view.status();
        continue;
      }
      EXPECT_EQ(view->record.vertex_count, 300 - i);
      EXPECT_TRUE(
          AuditContainment(CanonicalOf(*view), {sphere.data() + i, sphere.size() - i}).ok());
    }
    ++(damage ? reported : harmless);
  }
  RecordProperty("refused_to_open", refused_to_open);
  RecordProperty("reported", reported);
  RecordProperty("harmless", harmless);
  EXPECT_GT(refused_to_open, 0);
  EXPECT_GT(reported, 0);
}

// Simulates a process that is killed while it writes a record.
TEST_F(RocksDbDamage, ALogEndingInAPartialRecordLosesOnlyThatRecord) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  const std::string store_id = hulls_->store().id();
  const uint64_t revision = hulls_->View("a")->record.revision;
  hulls_ = nullptr;
  char half_record[40];
  ASSERT_TRUE(std::ifstream(LogFile(), std::ios::binary).read(half_record, sizeof half_record));
  std::ofstream(LogFile(), std::ios::binary | std::ios::app).write(half_record, sizeof half_record);
  Start();
  EXPECT_EQ(hulls_->View("a")->record.revision, revision);
  EXPECT_EQ(hulls_->View("a")->record.vertex_count, 8);
  EXPECT_EQ(hulls_->store().id(), store_id);
}

// Simulates an acknowledged record whose middle was lost.
TEST_F(RocksDbDamage, ALastRecordTornInTheMiddleIsDamage) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
  const std::string store_id = hulls_->store().id();
  hulls_ = nullptr;
  std::fstream log(LogFile(), std::ios::in | std::ios::out | std::ios::binary);
  log.seekp(-100, std::ios::end);
  log << std::string(50, '\0');
  log.close();
  EXPECT_EQ(OpenStore("data").status().code(), absl::StatusCode::kDataLoss);
  RocksDbOptions options;
  options.data_dir = directory_ + "/data";
  options.accept_loss = true;
  ASSERT_TRUE(RocksDbStore::Open(options).ok());
  Start();
  EXPECT_EQ(hulls_->View("a")->record.vertex_count, 8);
  EXPECT_EQ(hulls_->View("b")->record.vertex_count, 0);
  EXPECT_NE(hulls_->store().id(), store_id);
}

TEST_F(RocksDbDamage, ALogDamagedInTheMiddleCanBeCutThere) {
  Start();
  ASSERT_TRUE(hulls_->Put("a", CubeCorners()).ok());
  const std::string store_id = hulls_->store().id();
  const uint64_t revision = hulls_->View("a")->record.revision;
  const uintmax_t kept = std::filesystem::file_size(LogFile());
  ASSERT_TRUE(hulls_->Put("b", CubeCorners()).ok());
  ASSERT_TRUE(hulls_->Put("c", CubeCorners()).ok());
  hulls_ = nullptr;
  FlipBits(LogFile(), kept + 30, 1);
  EXPECT_EQ(OpenStore("data").status().code(), absl::StatusCode::kDataLoss);
  RocksDbOptions options;
  options.data_dir = directory_ + "/data";
  options.accept_loss = true;
  ASSERT_TRUE(RocksDbStore::Open(options).ok());
  Start();
  EXPECT_EQ(hulls_->View("a")->record.revision, revision);
  EXPECT_EQ(hulls_->View("b").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(hulls_->View("c").status().code(), absl::StatusCode::kNotFound);
  // Later changes get the revisions of b and c.
  EXPECT_NE(hulls_->store().id(), store_id);
}

}  // namespace store_damage_test
}  // namespace hulld::server
