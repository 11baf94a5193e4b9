// Copies of stores between RocksDB and PostgreSQL: complete, interrupted, damaged, and refused.
#include "server/migration/migration.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <latch>
#include <sstream>
#include <tuple>

#include "server/store/postgres/postgres_store.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_keys.h"
#include "tests/server/harness/postgres/postgres_cluster.h"
#include "tests/server/harness/small_disk.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace migration_test {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using AnyRegistry = TestRegistry<Store>;

// The location of an existing or future store.
class StorePlace {
 public:
  explicit StorePlace(const std::string& kind) {
    std::string name = ::testing::TempDir() + "hulld_migration_XXXXXX";
    directory_ = mkdtemp(name.data());
    if (kind == "rocksdb") return;
    database_ = PostgresCluster::Shared().MakeDatabase();
    conninfo_file_ = PostgresCluster::Shared().WriteConninfo(database_);
  }
  ~StorePlace() { std::filesystem::remove_all(directory_); }
  StorePlace(const StorePlace&) = delete;
  StorePlace& operator=(const StorePlace&) = delete;

  std::string data_dir() const { return directory_ + "/data"; }
  std::string conninfo() const { return PostgresCluster::Shared().Conninfo(database_); }
  const std::string& database() const { return database_; }
  bool is_postgres() const { return !database_.empty(); }

  // Returns the options of `hulld migrate`; side: "--from" or "--to".
  std::vector<std::string> Options(const std::string& side) const {
    if (is_postgres()) return {side + "-postgres-conninfo-file", conninfo_file_};
    return {side + "-data-dir", data_dir()};
  }

  absl::StatusOr<std::unique_ptr<Store>> Open() const {
    if (!is_postgres()) {
      RocksDbOptions options;
      options.data_dir = data_dir();
      absl::StatusOr<std::unique_ptr<RocksDbStore>> store = RocksDbStore::Open(options);
      if (!store.ok()) return store.status();
      return *std::move(store);
    }
    PostgresOptions options;
    options.conninfo = conninfo();
    absl::StatusOr<std::unique_ptr<PostgresStore>> store = PostgresStore::Open(options);
    if (!store.ok()) return store.status();
    return *std::move(store);
  }
  std::unique_ptr<AnyRegistry> Serve() const {
    absl::StatusOr<std::unique_ptr<Store>> store = Open();
    if (!store.ok()) {
      ADD_FAILURE() << store.status();
      std::abort();
    }
    auto registry = std::make_unique<AnyRegistry>(*std::move(store));
    EXPECT_TRUE(registry->loaded().ok()) << registry->loaded();
    return registry;
  }
  absl::StatusOr<std::unique_ptr<MigrationTarget>> OpenTarget() const {
    return is_postgres() ? OpenPostgresTarget(conninfo()) : OpenRocksDbTarget(data_dir());
  }

 private:
  std::string directory_;
  std::string database_;
  std::string conninfo_file_;
};

struct Ran {
  int code = -1;
  std::string out;
  std::string err;
};

Ran Migrate(const StorePlace& from, const StorePlace& to) {
  std::vector<std::string> arguments = from.Options("--from");
  for (const std::string& option : to.Options("--to")) arguments.push_back(option);
  std::ostringstream out;
  std::ostringstream err;
  const int code = RunMigrate(arguments, out, err);
  return {code, out.str(), err.str()};
}

// A wrapper of another target that fails after this many batches.
class InterruptedTarget : public MigrationTarget {
 public:
  InterruptedTarget(std::unique_ptr<MigrationTarget> target, int batches)
      : target_(std::move(target)), left_(batches) {}

  Store& store() override { return target_->store(); }
  absl::StatusOr<std::optional<MigrationSource>> ReadMark() override { return target_->ReadMark(); }
  absl::Status Begin(const MigrationSource& source) override { return target_->Begin(source); }
  absl::Status Add(std::span<const Change* const> changes) override {
    if (left_-- == 0) return absl::UnavailableError("interrupted");
    return target_->Add(changes);
  }
  absl::Status Finish(const MigrationSource& source) override { return target_->Finish(source); }

 private:
  const std::unique_ptr<MigrationTarget> target_;
  int left_;
};

class MigrationTest : public ::testing::TestWithParam<std::tuple<const char*, const char*>> {
 protected:
  void SetUp() override {
    const auto [from, to] = GetParam();
    const bool needs_postgres = from == std::string("postgres") || to == std::string("postgres");
    if (needs_postgres && !PostgresCluster::IsInstalled())
      GTEST_SKIP() << PostgresCluster::kMissing;
    from_ = std::make_unique<StorePlace>(from);
    to_ = std::make_unique<StorePlace>(to);
  }

  // Fills the source with hulls that grew, were recreated, or are empty, with one part or several;
  // writers beyond the first; a body; and more hulls than a transaction takes.
  void FillSource() {
    const auto hulls = from_->Serve();
    ASSERT_TRUE(hulls->Put("grown", CubeCorners()).ok());
    ASSERT_TRUE(hulls->Put("grown", {{9, 9, 9}}).ok());
    ASSERT_TRUE(hulls->Put("grown", {{-9, 9, 9}, {-0.0, 0, -20}}, "other").ok());
    ASSERT_TRUE(hulls->Put("again", CubeCorners()).ok());
    ASSERT_TRUE(hulls->Delete("again").ok());
    ASSERT_TRUE(hulls->Put("again", CubeCorners(2)).ok());
    ASSERT_TRUE(hulls->Create("empty").ok());
    ASSERT_TRUE(hulls->Put("large", SpherePoints(40'000)).ok());
    PutBody(*hulls, "zz");
    PutBody(*hulls, "a body");
    // Concurrently, so that they are committed together.
    std::latch created(kMany);
    for (int i = 0; i < kMany; ++i) {
      hulls->registry().changes().Create(absl::StrCat("many/", i), false, [&](const auto& result) {
        EXPECT_TRUE(result.ok()) << result.status();
        created.count_down();
      });
    }
    created.wait();
  }
  static void PutBody(AnyRegistry& hulls, const std::string& id) {
    StoredBody body;
    body.record.body_id = id;
    body.hull_ids = {"grown", "empty"};
    body.pieces = {{0, Pose()}, {1, Pose()}, {0, {.q = {1, 0, 0.5, 0}, .t = {0.1, -0.0, 3}}}};
    const auto put = AnyRegistry::Wait<PutBodyResult>([&](const Reply<PutBodyResult>& done) {
      hulls.registry().changes().PutBody(body, {}, done);
    });
    ASSERT_TRUE(put.ok()) << put.status();
  }

  // Expects equal client-visible state, except for the store ID.
  static void ExpectSame(AnyRegistry& a, AnyRegistry& b) {
    EXPECT_NE(a.store().id(), b.store().id());
    EXPECT_EQ(a.store().revision(), b.store().revision());
    EXPECT_EQ(a.registry().Sizes().hull_count, b.registry().Sizes().hull_count);
    EXPECT_EQ(a.registry().Sizes().body_count, b.registry().Sizes().body_count);
    for (const char* id : {"grown", "again", "empty", "large", "many/7"}) {
      const auto x = a.View(id);
      const auto y = b.View(id);
      ASSERT_TRUE(x.ok() && y.ok()) << x.status() << y.status();
      EXPECT_EQ(x->record, y->record);
      EXPECT_TRUE(std::ranges::equal(CanonicalOf(*x).vertices(), CanonicalOf(*y).vertices()));
    }
    for (const char* writer : {"w", "other", "none"}) {
      const auto x = a.Open("grown", writer);
      const auto y = b.Open("grown", writer);
      ASSERT_TRUE(x.ok() && y.ok());
      EXPECT_EQ(x->last_sequence, y->last_sequence) << writer;
    }
  }

  static constexpr int kMany = 2500;
  std::unique_ptr<StorePlace> from_;
  std::unique_ptr<StorePlace> to_;
};

TEST_P(MigrationTest, TheCopyServesTheSameContents) {
  FillSource();
  const Ran ran = Migrate(*from_, *to_);
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, StartsWith("copied store "));
  EXPECT_THAT(ran.out, HasSubstr(absl::StrCat(": ", kMany + 4, " hulls, 2 bodies\n")));
  EXPECT_THAT(ran.out, HasSubstr("\nverified: all records match; "));
  const auto source = from_->Serve();
  const auto copy = to_->Serve();
  EXPECT_THAT(ran.out, HasSubstr("is now store " + copy->store().id() + "\n"));
  ExpectSame(*source, *copy);
  // It continues at the source's revision.
  ASSERT_TRUE(copy->Put("grown", {{0, 0, 99}}).ok());
  EXPECT_EQ(copy->View("grown")->record.revision, source->store().revision() + 1);
  ASSERT_TRUE(copy->Delete("large").ok());
}

TEST_P(MigrationTest, AnInterruptedRunIsResumed) {
  FillSource();
  uint64_t before = 0;
  // The second batch is refused, then the third run's fifth.
  for (const int batches : {0, 1, 1}) {
    const auto source = from_->Open();
    ASSERT_TRUE(source.ok());
    auto target = to_->OpenTarget();
    ASSERT_TRUE(target.ok()) << target.status();
    InterruptedTarget interrupted(*std::move(target), batches);
    auto migration = Migration::Read(**source, [](uint64_t, uint64_t) {});
    ASSERT_TRUE(migration.ok()) << migration.status();
    EXPECT_TRUE(absl::IsUnavailable(migration->CopyTo(interrupted).status()));
    // A partial copy is not mistaken for a complete one.
    EXPECT_TRUE(absl::IsDataLoss(migration->Compare(interrupted.store())));
    uint64_t held = 0;
    const auto count = [&held](const auto&...) { ++held; };
    ASSERT_TRUE(interrupted.store().ForEachRecord(count, [](const auto&...) {}).ok());
    EXPECT_EQ(held > before, batches > 0);
    before = held;
  }
  // No server opens a partial copy.
  const absl::Status opened = to_->Open().status();
  EXPECT_TRUE(absl::IsFailedPrecondition(opened)) << opened;
  EXPECT_THAT(std::string(opened.message()),
              HasSubstr("run the same 'hulld migrate' command again"));
  const Ran ran = Migrate(*from_, *to_);
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr(absl::StrCat("; ", before, " of them copied by an earlier run")));
  ExpectSame(*from_->Serve(), *to_->Serve());
}

TEST_P(MigrationTest, AChangedSourceIsCopiedAgain) {
  FillSource();
  {
    const auto source = from_->Open();
    auto target = to_->OpenTarget();
    ASSERT_TRUE(source.ok() && target.ok());
    InterruptedTarget interrupted(*std::move(target), 2);
    EXPECT_FALSE(Migration::Read(**source, [](auto...) {})->CopyTo(interrupted).ok());
  }
  {
    const auto hulls = from_->Serve();
    ASSERT_TRUE(hulls->Put("again", {{7, 7, 7}}).ok());
    ASSERT_TRUE(hulls->Delete("many/1").ok());
  }
  const Ran ran = Migrate(*from_, *to_);
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr(absl::StrCat(": ", kMany + 3, " hulls, 2 bodies\n")));
  ExpectSame(*from_->Serve(), *to_->Serve());
}

// Chunks without new vertices take no revision of the store.
TEST_P(MigrationTest, ASourceWithChangedCountsIsCopiedAgain) {
  FillSource();
  std::vector<std::string> copied;
  {
    const auto source = from_->Open();
    auto target = to_->OpenTarget();
    ASSERT_TRUE(source.ok() && target.ok());
    InterruptedTarget interrupted(*std::move(target), 2);
    EXPECT_FALSE(Migration::Read(**source, [](auto...) {})->CopyTo(interrupted).ok());
    const auto note = [&copied](const std::string& id, const auto&) { copied.push_back(id); };
    ASSERT_TRUE(interrupted.store().ForEachRecord(note, [](const auto&...) {}).ok());
    ASSERT_FALSE(copied.empty());
  }
  {
    const auto hulls = from_->Serve();
    const uint64_t revision = hulls->store().revision();
    ASSERT_TRUE(hulls->Put(copied.front(), {}).ok());
    ASSERT_TRUE(hulls->Put(copied.back(), {}).ok());
    EXPECT_EQ(hulls->store().revision(), revision);
  }
  const Ran ran = Migrate(*from_, *to_);
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("starting the copy over"));
  ExpectSame(*from_->Serve(), *to_->Serve());
}

// As after a run that was killed before it reported the end.
TEST_P(MigrationTest, AFinishedCopyIsRecognized) {
  FillSource();
  ASSERT_EQ(Migrate(*from_, *to_).code, 0);
  const std::string id = to_->Serve()->store().id();
  const Ran ran = Migrate(*from_, *to_);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("all records match"));
  EXPECT_THAT(ran.out, HasSubstr("store " + id));
  // Same revision, but another count.
  { ASSERT_TRUE(from_->Serve()->Put("grown", {{0.5, 0.5, 0.5}}).ok()); }
  const Ran changed = Migrate(*from_, *to_);
  EXPECT_EQ(changed.code, 2);
  EXPECT_THAT(changed.err, HasSubstr("the destination is not empty"));
}

TEST_P(MigrationTest, OnlyAnEmptyDestinationIsAccepted) {
  ASSERT_TRUE(from_->Serve()->Put("h", CubeCorners()).ok());
  // A store created by a server that never held data is accepted.
  { to_->Serve(); }
  ASSERT_EQ(Migrate(*from_, *to_).code, 0);
  ASSERT_TRUE(to_->Serve()->Put("h", {{9, 9, 9}}).ok());
  const Ran ran = Migrate(*from_, *to_);
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("the destination is not empty: it is store "));
  EXPECT_EQ(to_->Serve()->View("h")->record.counts.received, 9);
  // A store that was emptied is refused: its clients know its revisions.
  ASSERT_TRUE(to_->Serve()->Delete("h").ok());
  EXPECT_EQ(Migrate(*from_, *to_).code, 2);
}

TEST_P(MigrationTest, AnUnfinishedCopyOfAnotherStoreIsNotChanged) {
  ASSERT_TRUE(from_->Serve()->Put("h", CubeCorners()).ok());
  {
    auto target = to_->OpenTarget();
    ASSERT_TRUE(target.ok());
    ASSERT_TRUE((*target)->Begin({"another", 7}).ok());
  }
  const Ran ran = Migrate(*from_, *to_);
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("an unfinished migration from store another"));
}

TEST_P(MigrationTest, AnOpenStoreIsRefused) {
  ASSERT_TRUE(from_->Serve()->Put("h", CubeCorners()).ok());
  for (const StorePlace* busy : {from_.get(), to_.get()}) {
    const auto server = busy->Serve();
    const Ran ran = Migrate(*from_, *to_);
    EXPECT_EQ(ran.code, 2) << ran.err;
    EXPECT_THAT(ran.err, HasSubstr(busy->is_postgres() ? "a hulld is active on this database"
                                                       : "is in use by another hulld"));
  }
  EXPECT_EQ(Migrate(*from_, *to_).code, 0);
}

TEST_P(MigrationTest, AMissingSourceIsNotCreated) {
  Ran ran = Migrate(*from_, *to_);
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("contains no hulld store"));
  ran = Migrate(*from_, *to_);
  EXPECT_EQ(ran.code, 2);
}

// The comparison covers the copied data and finds every kind of difference.
TEST_P(MigrationTest, DifferencesAreFound) {
  FillSource();
  ASSERT_EQ(Migrate(*from_, *to_).code, 0);
  const auto differ = [this](const auto& change) {
    change(*to_->Serve());
    const auto source = from_->Open();
    const auto copy = to_->Open();
    return std::string(Migration::Read(**source, [](auto...) {})->Compare(**copy).message());
  };
  EXPECT_EQ(differ([](AnyRegistry&) {}), "");
  EXPECT_THAT(differ([](AnyRegistry& r) { PutBody(r, "a body"); }),
              HasSubstr("\"a body\" differs in the copy: its record or its pieces"));
  EXPECT_THAT(differ([](AnyRegistry& r) { r.Put("zzz", {}).IgnoreError(); }),
              HasSubstr("\"zzz\" differs in the copy: it is not in the source"));
  EXPECT_THAT(differ([](AnyRegistry& r) {
                r.Delete("zzz").IgnoreError();
                r.Delete("many/9").IgnoreError();
              }),
              HasSubstr("\"many/9\" differs in the copy: it is missing"));
  EXPECT_THAT(differ([](AnyRegistry& r) {
                r.Put("again", {{9, 9, 9}}).IgnoreError();
              }),
              HasSubstr("\"again\" differs in the copy: its record"));
}

// Each value of the source is whole.
TEST(MigrationOfADatabase, LostRowsAreFound) {
  if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
  const StorePlace from("postgres");
  {
    const auto hulls = from.Serve();
    ASSERT_TRUE(hulls->Put("h", CubeCorners()).ok());
    ASSERT_TRUE(hulls->Put("other", CubeCorners()).ok());
  }
  const auto expect_refused = [&](const std::string& sql, const std::string& finding) {
    PostgresCluster::Shared().RunSql(from.database(), sql);
    const StorePlace to("rocksdb");
    const Ran ran = Migrate(from, to);
    EXPECT_EQ(ran.code, 1) << ran.out;
    EXPECT_THAT(ran.err, HasSubstr(finding));
    EXPECT_EQ(to.Serve()->store().revision(), 0);
  };
  const std::string revision =
      PostgresCluster::Shared().RunSql(from.database(), "SELECT revision FROM hulld.store").at(0);
  expect_refused("UPDATE hulld.store SET revision = 1", "a change of revision " + revision);
  expect_refused("UPDATE hulld.store SET revision = " + revision +
                     "; DELETE FROM hulld.hulls WHERE hull_id = 'h'",
                 "the source has recorded 2 hulls and 0 bodies, but contains 1 and 0");
}

TEST_P(MigrationTest, TheCommandLineIsChecked) {
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(RunMigrate({"--from-data-dir", "x"}, out, err), 2);
  EXPECT_THAT(err.str(), HasSubstr("set one source"));
  EXPECT_EQ(RunMigrate({"--from", "x"}, out, err), 2);
  EXPECT_EQ(RunMigrate({"--from-data-dir", "x", "--to-data-dir", "x"}, out, err), 2);
  EXPECT_THAT(err.str(), HasSubstr("source and destination are both x"));
  EXPECT_EQ(RunMigrate({"--help"}, out, err), 0);
  EXPECT_THAT(out.str(), HasSubstr("the copy is a new store"));
}

TEST(MigrationOfADirectory, AnotherNameOfTheSourceIsRefused) {
  const StorePlace from("rocksdb");
  ASSERT_TRUE(from.Serve()->Put("h", CubeCorners()).ok());
  const std::string source = from.data_dir();
  std::filesystem::create_directory_symlink(source, source + "-link");
  for (const std::string& to : {source + "/", source + "-link"}) {
    std::ostringstream out;
    std::ostringstream err;
    EXPECT_EQ(RunMigrate({"--from-data-dir", source, "--to-data-dir", to}, out, err), 2) << to;
    EXPECT_THAT(err.str(), HasSubstr("--data-dir " + to + " is in use by another hulld"));
  }
}

TEST(MigrationOfADirectory, AFullDiskInterruptsIt) {
  const SmallDisk disk(2);
  if (!disk.is_mounted()) GTEST_SKIP() << SmallDisk::kNoMount;
  const StorePlace from("rocksdb");
  ASSERT_TRUE(from.Serve()->Put("h", SpherePoints(100'000)).ok());
  const std::vector<std::string> arguments = {"--from-data-dir", from.data_dir(), "--to-data-dir",
                                              disk.directory() + "/data"};
  for (int run = 0; run < 2; ++run) {
    std::ostringstream out;
    std::ostringstream err;
    EXPECT_EQ(RunMigrate(arguments, out, err), 1);
    EXPECT_THAT(err.str(), HasSubstr("the disk of the destination is full\n"));
    EXPECT_THAT(err.str(), HasSubstr("fix the cause, then run the same command again"));
    EXPECT_THAT(err.str(), Not(HasSubstr("nothing was changed")));
  }
  disk.Resize(64);
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(RunMigrate(arguments, out, err), 0) << err.str();
}

#ifdef HULLD_SANITIZED
// Fewer cases: each kind of store is the source in one and the destination in the other.
const auto kPlaces =
    ::testing::Values(std::tuple("rocksdb", "postgres"), std::tuple("postgres", "rocksdb"));
#else
const auto kPlaces = ::testing::Combine(::testing::Values("rocksdb", "postgres"),
                                        ::testing::Values("rocksdb", "postgres"));
#endif
INSTANTIATE_TEST_SUITE_P(Kinds, MigrationTest, kPlaces, [](const auto& kinds) {
  return absl::StrCat(std::get<0>(kinds.param), "_to_", std::get<1>(kinds.param));
});

}  // namespace migration_test
}  // namespace hulld::server
