// Contents of a durable store after it was reopened.

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/hull/audit.h"
#include "server/store/store_keys.h"
#include "tests/server/harness/kept_store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {
namespace store_recovery_test {

using ::testing::HasSubstr;

class StoreRecovery : public KeptStoreTest {
 protected:
  // Counts the stored keys of one kind.
  size_t CountKeys(char prefix) { return kept_->Count(prefix); }
};

INSTANTIATE_TEST_SUITE_P(Kinds, StoreRecovery, KeptStores(), KeptStoreName);

class RocksDbRecovery : public StoreTest {};

void ExpectSame(const HullView& a, const HullView& b) {
  EXPECT_EQ(a.record, b.record);
  const Hull& x = CanonicalOf(a);
  const Hull& y = CanonicalOf(b);
  EXPECT_TRUE(std::ranges::equal(x.vertices(), y.vertices()));
  EXPECT_TRUE(std::ranges::equal(x.edges(), y.edges()));
  ASSERT_EQ(x.facet_count(), y.facet_count());
  for (size_t i = 0; i < x.facet_count(); ++i) {
    EXPECT_TRUE(std::ranges::equal(x.facet(i), y.facet(i)));
  }
}

TEST_P(StoreRecovery, AcknowledgedChangesSurviveAReopen) {
  KeptRegistry& first = Start();
  ASSERT_TRUE(first.Create("empty").ok());
  ASSERT_TRUE(first.Put("point", {{1, 2, 3}, {1, 2, 3}}).ok());
  ASSERT_TRUE(first.Put("cube", CubeCorners(), "one").ok());
  ASSERT_TRUE(first.Put("cube", {{0.5, 0.5, 0.5}, {3, 3, 3}}, "two").ok());
  ASSERT_TRUE(first.Put("gone", CubeCorners()).ok());
  ASSERT_TRUE(first.Delete("gone").ok());
  const std::string id = first.store().id();
  const RegistrySizes sizes = first.registry().Sizes();
  const HullView empty = *first.View("empty");
  const HullView point = *first.View("point");
  const HullView cube = *first.View("cube");

  KeptRegistry& second = Start();
  EXPECT_EQ(second.store().id(), id);
  EXPECT_EQ(second.registry().Sizes().store_revision, sizes.store_revision);
  EXPECT_EQ(second.registry().Sizes().hull_count, 3);
  EXPECT_EQ(second.registry().Sizes().vertex_count, sizes.vertex_count);
  ExpectSame(*second.View("empty"), empty);
  ExpectSame(*second.View("point"), point);
  ExpectSame(*second.View("cube"), cube);
  EXPECT_EQ(second.View("gone").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(second.Open("cube", "one")->last_sequence, 1);
  EXPECT_EQ(second.Open("cube", "three")->last_sequence, 0);
  // Revisions and sequences continue.
  const auto next = second.Put("cube", {{9, 9, 9}}, "one");
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(next->hull_revision, sizes.store_revision + 1);
  EXPECT_EQ(second.Open("cube", "one")->last_sequence, 2);
}

TEST_P(StoreRecovery, AHullOfManyDeltasIsRestoredBitForBit) {
  const std::vector<Vector> sphere = SpherePoints(6000);
  KeptRegistry& first = Start();
  const AppendSession session = first.Open("h")->session;
  uint64_t sequence = 0;
  for (size_t i = 0; i < sphere.size(); i += 40) {
    const auto chunk = std::vector<Vector>(sphere.begin() + i, sphere.begin() + i + 40);
    ASSERT_TRUE(first.Append(session, ++sequence, chunk).ok());
  }
  const HullView before = *first.View("h");
  EXPECT_TRUE(AuditHull(CanonicalOf(before)).ok());
  // 144 kB of vertices: folded when the deltas reached 64 KiB, not with each chunk.
  const size_t deltas = CountKeys(kDeltaPrefix);
  EXPECT_GT(deltas, 0);
  EXPECT_LT(deltas, sequence);
  EXPECT_EQ(CountKeys(kBasePrefix), 1);
  ExpectSame(*Start().View("h"), before);
}

TEST_P(StoreRecovery, AChunkThatChangesNoVertexWritesOnlyItsCounters) {
  KeptRegistry& first = Start();
  const AppendSession session = first.Open("h")->session;
  ASSERT_TRUE(first.Append(session, 1, CubeCorners()).ok());
  const size_t vertices = CountKeys(kDeltaPrefix) + CountKeys(kBasePrefix);
  for (uint64_t i = 2; i <= 50; ++i) {
    const auto result = first.Append(session, i, std::vector<Vector>(1000, Vector(0.5, 0.5, 0.5)));
    ASSERT_EQ(result->counts.inside, 1000);
  }
  EXPECT_EQ(CountKeys(kDeltaPrefix) + CountKeys(kBasePrefix), vertices);
  EXPECT_EQ(Start().View("h")->record.counts.inside, 49'000);
}

TEST_P(StoreRecovery, ADeletedHullLeavesNothing) {
  KeptRegistry& first = Start();
  ASSERT_TRUE(first.Put("h", SpherePoints(40'000)).ok());
  EXPECT_GT(CountKeys(kBasePrefix), 1);
  ASSERT_TRUE(first.Delete("h").ok());
  for (const char prefix : {kHullPrefix, kWriterPrefix, kBasePrefix, kDeltaPrefix}) {
    EXPECT_EQ(CountKeys(prefix), 0) << prefix;
  }
}

TEST_P(StoreRecovery, ALargeBaseInPartsIsRestored) {
  ASSERT_TRUE(Start().Put("h", SpherePoints(70'000)).ok());
  const HullView before = *hulls_->View("h");
  EXPECT_EQ(CountKeys(kBasePrefix), 3);
  ExpectSame(*Start().View("h"), before);
}

TEST_P(StoreRecovery, AReplacedHullIsANewIncarnation) {
  KeptRegistry& first = Start();
  ASSERT_TRUE(first.Put("h", SpherePoints(500), "w").ok());
  const HullView old = *first.View("h");
  auto builder = std::make_shared<HullBuilder>();
  const PointCounts counts = *builder->Add(CubeCorners());
  EXPECT_EQ(first.Replace({"h", old.record.revision + 7, false, builder, counts}).status().code(),
            absl::StatusCode::kAborted);
  const auto replaced = first.Replace({"h", old.record.revision, false, builder, counts});
  ASSERT_TRUE(replaced.ok()) << replaced.status();
  EXPECT_FALSE(replaced->created);
  EXPECT_GT(replaced->hull.create_revision, old.record.revision);
  EXPECT_EQ(replaced->hull.vertex_count, 8);
  const HullView view = *first.View("h");
  EXPECT_EQ(view.record, replaced->hull);
  EXPECT_EQ(first.Open("h", "w")->last_sequence, 0);
  EXPECT_EQ(first.registry().Sizes().vertex_count, 8);
  EXPECT_EQ(CountKeys(kWriterPrefix), 0);
  EXPECT_EQ(CountKeys(kDeltaPrefix) + CountKeys(kBasePrefix), 1);
  ExpectSame(*Start().View("h"), view);
}

TEST_P(StoreRecovery, ReplacingAMissingHullNeedsCreateIfAbsent) {
  KeptRegistry& first = Start();
  const auto cube = [] {
    auto builder = std::make_shared<HullBuilder>();
    EXPECT_TRUE(builder->Add(CubeCorners()).ok());
    return builder;
  };
  EXPECT_EQ(first.Replace({"h", {}, false, cube(), {}}).status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(first.Replace({"h", 3, true, cube(), {}}).status().code(), absl::StatusCode::kAborted);
  EXPECT_TRUE(first.Replace({"h", 0, true, cube(), {}})->created);
  EXPECT_EQ(first.Replace({"h", 0, true, cube(), {}}).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(Start().View("h")->record.vertex_count, 8);
}

TEST_P(StoreRecovery, BodiesAreRestoredAndDamagedIndividually) {
  KeptRegistry& first = Start();
  ASSERT_TRUE(first.Put("cube", CubeCorners()).ok());
  const auto put = [this](const std::string& id, double x) {
    StoredBody body;
    body.record.body_id = id;
    body.hull_ids = {"cube"};
    body.pieces.resize(2);
    body.pieces[1].X_BP.t = Vector(x, 0, 0);
    return KeptRegistry::Wait<PutBodyResult>([&](const Reply<PutBodyResult>& done) {
      hulls_->registry().changes().PutBody(body, std::nullopt, done);
    });
  };
  ASSERT_TRUE(put("changed", 1).ok());
  ASSERT_TRUE(put("changed", 2).ok());
  ASSERT_TRUE(put("damaged", 3).ok());
  ASSERT_TRUE(put("gone", 4).ok());
  ASSERT_TRUE(KeptRegistry::Wait<uint64_t>([&](const Reply<uint64_t>& done) {
                first.registry().changes().Delete("body", "gone", std::nullopt, done);
              }).ok());
  std::string value = kept_->Get(BodyKey("damaged"));
  value[value.size() / 2] ^= 4;
  kept_->Put(BodyKey("damaged"), value);
  Start();
  EXPECT_EQ(CountKeys(kBodyPrefix), 2);
  std::vector<std::string> seen;
  const absl::Status read = hulls_->store().ForEachRecord(
      [](const auto&...) {},
      [&](const std::string& id, const absl::StatusOr<StoredBody>& body) {
        seen.push_back(id);
        EXPECT_EQ(body.ok(), id == "changed") << body.status();
        EXPECT_EQ(absl::IsDataLoss(body.status()), id == "damaged");
        EXPECT_EQ(body.ok() ? body->pieces.at(1).X_BP.t.x() : 0, id == "changed" ? 2 : 0);
      });
  EXPECT_TRUE(read.ok()) << read;
  EXPECT_THAT(seen, ::testing::ElementsAre("changed", "damaged"));
}

TEST_P(StoreRecovery, ASessionIsNotifiedThatItsHullWasReplaced) {
  KeptRegistry& hulls = Start();
  std::promise<absl::Status> gone;
  const auto opened = KeptRegistry::Wait<OpenResult>([&](Reply<OpenResult> done) {
    hulls.registry().changes().OpenAppend(
        "h", "w", true, [&](const absl::Status& reason) { gone.set_value(reason); },
        std::move(done));
  });
  ASSERT_TRUE(hulls.Append(opened->session, 1, CubeCorners()).ok());
  ASSERT_TRUE(hulls.Replace({"h", {}, false, std::make_shared<HullBuilder>(), {}}).ok());
  const absl::Status reason = gone.get_future().get();
  EXPECT_EQ(reason.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(reason.message()), HasSubstr("hull \"h\" was replaced"));
  EXPECT_EQ(hulls.Append(opened->session, 2, CubeCorners()).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(hulls.View("h")->record.vertex_count, 0);
}

TEST_P(StoreRecovery, ChangesThatWaitTogetherAreCommittedTogether) {
  KeptRegistry& hulls = Start();
  constexpr int kHulls = 200;
  std::vector<std::promise<absl::StatusOr<PutHullResult>>> replies(kHulls);
  for (int i = 0; i < kHulls; ++i) {
    hulls.registry().changes().Create(
        absl::StrCat("h", i), false,
        [&replies, i](absl::StatusOr<PutHullResult> r) { replies[i].set_value(std::move(r)); });
  }
  std::vector<uint64_t> revisions;
  for (auto& reply : replies) revisions.push_back(reply.get_future().get()->hull.revision);
  EXPECT_TRUE(std::ranges::is_sorted(revisions));
  EXPECT_EQ(hulls.registry().Commits().changes, kHulls);
  EXPECT_LT(hulls.registry().Commits().batches, kHulls);
}

TEST_F(RocksDbRecovery, StartupRemovesOnlyOldCopies) {
  Start();
  const absl::StatusOr<std::string> copy = hulls_->store().MakeCopy();
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_TRUE(std::filesystem::exists(*copy + "/rocksdb/CURRENT"));
  const std::string others = directory_ + "/data/copy-before-upgrade/rocksdb";
  std::filesystem::create_directories(others);
  Start();
  EXPECT_FALSE(std::filesystem::exists(*copy));
  EXPECT_TRUE(std::filesystem::exists(others));
}

TEST_F(RocksDbRecovery, ASecondServerIsRefused) {
  Start();
  const auto second = OpenStore();
  EXPECT_EQ(second.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("in use by another hulld"));
}

// RocksDB locks only a file, and within a process only one name of it.
TEST_F(RocksDbRecovery, ASecondServerIsRefusedAfterTheLockFileWasDeleted) {
  Start();
  ASSERT_TRUE(std::filesystem::remove(directory_ + "/data/rocksdb/LOCK"));
  RocksDbOptions options;
  options.data_dir = directory_ + "/data/.";
  for (const bool read_only : {false, true}) {
    options.read_only = read_only;
    const absl::Status second = RocksDbStore::Open(options).status();
    EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition) << second;
    EXPECT_THAT(std::string(second.message()), HasSubstr("in use by another hulld"));
  }
}

TEST_P(StoreRecovery, AnOlderOrNewerFormatIsRefused) {
  const std::vector<uint64_t> formats = kept_->formats();
  Start();
  for (const uint64_t format : formats) {
    kept_->SetFormat(format);
    Start();
  }
  for (const uint64_t other : {formats.front() - 1, formats.back() + 1}) {
    SetUp();
    Start();
    kept_->SetFormat(other);
    hulls_ = nullptr;
    const auto store = kept_->Open();
    EXPECT_EQ(store.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(store.status().message()),
                HasSubstr(absl::StrCat("is in format ", other, "; this hulld uses format ",
                                       formats.back(), "; run the hulld version that wrote it")));
  }
}

TEST_P(StoreRecovery, WritersPerHullAreLimited) {
  Limits limits;
  limits.max_writers_per_hull = 2;
  KeptRegistry& hulls = Start(limits);
  ASSERT_TRUE(hulls.Put("h", CubeCorners(), "one").ok());
  ASSERT_TRUE(hulls.Put("h", CubeCorners(), "two").ok());
  const auto third = hulls.Put("h", CubeCorners(), "three");
  EXPECT_EQ(third.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(third.status().message()), HasSubstr("--max-writers-per-hull"));
  EXPECT_TRUE(hulls.Put("h", CubeCorners(), "one").ok());
  KeptRegistry& again = Start(limits);
  EXPECT_EQ(again.Put("h", CubeCorners(), "three").status().code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(again.Put("h", CubeCorners(), "two").ok());
}

}  // namespace store_recovery_test
}  // namespace hulld::server
