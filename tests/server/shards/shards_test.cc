#include "server/shards/shards.h"

#include <absl/strings/str_cat.h>

#include <map>
#include <mutex>
#include <random>
#include <set>

#include "tests/server/shards/shards_fixture.h"

namespace hulld::server {
namespace {

using ::testing::HasSubstr;

// The revisions of two hulls, 0 where there is none.
using Pair = std::pair<uint64_t, uint64_t>;

Pair PairOf(const ShardsResolved& resolved) {
  const auto revision = [](const absl::StatusOr<HullView>& hull) {
    return hull.ok() ? hull->record.revision : 0;
  };
  return {revision(resolved.hulls[0]), revision(resolved.hulls[1])};
}

TEST_F(ShardsTest, AHullLivesInTheShardOfItsIdAndNowhereElse) {
  for (size_t shard = 0; shard < kShards; ++shard) {
    const std::string id = IdIn(shard);
    ASSERT_TRUE(Create(id).ok());
    for (size_t other = 0; other < kShards; ++other) {
      EXPECT_EQ(shards_->at(other).List("", "", 10)->hulls.size(), other <= shard ? 1 : 0);
    }
    EXPECT_EQ(shards_->store_id_of(id), stores_[shard]->id());
  }
  EXPECT_EQ(shards_->Sizes().hull_count, kShards);
}

TEST_F(ShardsTest, AnAnswerNamesTheRevisionOfEachShardThatItTouches) {
  const std::string a = IdIn(0);
  const std::string c = IdIn(2);
  Replace(a);
  Replace(c);
  Replace(c);
  const auto both = Resolve({c, a, c});
  ASSERT_TRUE(both.ok());
  EXPECT_EQ(both->as_of.revisions, (ShardRevisions{{0, 1}, {2, 2}}));
  // In the order asked for.
  EXPECT_EQ(both->hulls[0]->record.hull_id, c);
  EXPECT_EQ(both->hulls[1]->record.hull_id, a);
  EXPECT_EQ(both->hulls[2]->record.hull_id, c);
  const auto one = Resolve({c});
  ASSERT_TRUE(one.ok());
  EXPECT_EQ(one->as_of.revisions, (ShardRevisions{{2, 2}}));
}

TEST_F(ShardsTest, ListsAreMergedInTheOrderOfIdsAndInPages) {
  std::vector<std::string> ids;
  for (int i = 0; i < 40; ++i) ids.push_back(absl::StrCat("list/", i));
  for (const std::string& id : ids) ASSERT_TRUE(Create(id).ok());
  ASSERT_TRUE(Create("other").ok());
  std::ranges::sort(ids);
  for (const size_t page_size : {1, 7, 40, 1000}) {
    std::vector<std::string> listed;
    std::string after;
    while (true) {
      const ShardsHullPage page = shards_->List("list/", after, page_size).value();
      EXPECT_EQ(page.revisions.size(), kShards);
      EXPECT_LE(page.hulls.size(), page_size);
      for (const ListedHull& hull : page.hulls) listed.push_back(hull.record.hull_id);
      if (!page.more) break;
      ASSERT_FALSE(page.hulls.empty());
      after = listed.back();
    }
    EXPECT_EQ(listed, ids);
  }
}

TEST_F(ShardsTest, TheLimitOfHullsHoldsOverAllShards) {
  Limits limits;
  limits.max_hulls = 3;
  Begin(limits);
  for (size_t shard = 0; shard < 3; ++shard) ASSERT_TRUE(Create(IdIn(shard)).ok());
  for (size_t shard = 0; shard < 3; ++shard) {
    const absl::Status status = Create(IdIn(shard, "more")).status();
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("other shards 2"));
  }
  ASSERT_TRUE(Delete(IdIn(0)).ok());
  EXPECT_TRUE(Create(IdIn(1, "more")).ok());
}

TEST_F(ShardsTest, MemoryIsSplitOverShards) {
  Limits limits;
  limits.memory_limit = 3000;
  Begin(limits);
  EXPECT_EQ(shards_->limits().memory_limit, 3000);
  EXPECT_EQ(shards_->Cache().limit_bytes, 3000);
  std::set<const MemoryBudget*> budgets;
  for (size_t i = 0; i < kShards; ++i) budgets.insert(&shards_->memory());
  EXPECT_EQ(budgets.size(), kShards);
  // One that is over its part is no reason to refuse while others have room.
  const uint64_t share = shards_->at(0).memory().share(MemoryUse::kReading);
  MemoryCharge charge(shards_->at(0).memory(), MemoryUse::kReading, 2 * share);
  EXPECT_TRUE(shards_->CheckMemory(MemoryUse::kReading).ok());
  charge.Set(4 * share);
  EXPECT_TRUE(absl::IsResourceExhausted(shards_->CheckMemory(MemoryUse::kReading)));
}

// Both hulls change after the first was looked up and before the second is: what was found first
// of one and of the other never was together.
TEST_F(ShardsTest, APairThatWasNeverThereIsNotAnswered) {
  const std::string a = IdIn(0);
  const std::string b = IdIn(1);
  for (const int changes : {1, 2, 3, 8}) {
    std::set<Pair> states;
    Pair now = {Replace(a), Replace(b)};
    states.insert(now);
    int left = changes;
    int parts = 0;
    shards_->OnPart([&] {
      if (++parts % 2 == 0 || left == 0) return;
      --left;
      now.first = Replace(a);
      states.insert(now);
      now.second = Replace(b);
      states.insert(now);
    });
    const auto resolved = Resolve({a, b});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    EXPECT_TRUE(states.contains(PairOf(*resolved))) << changes;
    EXPECT_EQ(left, 0);
    EXPECT_GE(parts, 4);
    shards_->OnPart(nullptr);
  }
}

TEST_F(ShardsTest, AHullThatChangesAllTheTimeDoesNotHoldUpWhoAsksForAPair) {
  const std::string hot = IdIn(0);
  const std::string quiet = IdIn(1);
  for (const bool is_first : {true, false}) {
    uint64_t last = Replace(hot);
    const uint64_t stays = Replace(quiet);
    std::set<uint64_t> revisions = {last};
    shards_->OnPart([&] { revisions.insert(last = Replace(hot)); });
    const auto resolved = is_first ? Resolve({hot, quiet}) : Resolve({quiet, hot});
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    const auto& hulls = resolved->hulls;
    EXPECT_TRUE(revisions.contains(hulls[is_first ? 0 : 1]->record.revision));
    EXPECT_EQ(hulls[is_first ? 1 : 0]->record.revision, stays);
    // Three looks at two shards.
    EXPECT_EQ(revisions.size(), 7);
    shards_->OnPart(nullptr);
  }
}

// Hulls of all shards change between any two looks. Each change is submitted and not waited for, so
// that one of a shard that is held stays under way.
TEST_F(ShardsTest, WhereSeveralShardsChangeAllTheTimeTheyAreHeldForOneLook) {
  const std::string ids[] = {IdIn(0), IdIn(1), IdIn(2)};
  for (const std::string& id : ids) Replace(id);
  for (const size_t count : {2, 3}) {
    std::mutex mutex;
    std::map<std::string, std::set<uint64_t>> revisions;
    std::vector<std::future<void>> changes;
    int parts = 0;
    shards_->OnPart([&] {
      ++parts;
      const bool may_be_held = shards_->Commits().holds > 0;
      for (const std::string& id : ids) {
        const auto change = [&, id] {
          const uint64_t revision = Replace(id);
          const std::lock_guard lock(mutex);
          revisions[id].insert(revision);
        };
        changes.push_back(std::async(std::launch::async, change));
        if (!may_be_held) changes.back().wait();
      }
    });
    const auto resolved = Resolve({ids, ids + count});
    for (const auto& change : changes) change.wait();
    ASSERT_TRUE(resolved.ok()) << resolved.status();
    EXPECT_EQ(parts, static_cast<int>(count) * (Shards::kLooks + 1) + 1);
    for (size_t i = 0; i < count; ++i) {
      EXPECT_TRUE(revisions[ids[i]].contains(resolved->hulls[i]->record.revision));
    }
    // All shards of the call but one.
    EXPECT_EQ(shards_->Commits().holds, count - 1);
    Begin({});
    for (const std::string& id : ids) Replace(id);
  }
}

TEST_F(ShardsTest, WhoIsContentWithAnyAgeLooksOnceWhateverChanges) {
  const std::string a = IdIn(0);
  const std::string b = IdIn(1);
  Replace(a);
  Replace(b);
  int parts = 0;
  shards_->OnPart([&] {
    ++parts;
    Replace(a);
    Replace(b);
  });
  const std::vector<std::string> ids = {a, b};
  const auto any = Resolve(ids, {.freshness = ShardsFreshness::OfWhatIsHere()});
  EXPECT_TRUE(any.ok());
  EXPECT_EQ(parts, 2);
}

// Hulls come, change and go at random while pairs are read; what is read was there.
TEST_F(ShardsTest, EveryPairThatIsAnsweredWasThereAtAnInstant) {
  const std::string ids[] = {IdIn(0), IdIn(2)};
  std::mt19937_64 random(7);
  Pair now = {0, 0};
  std::set<Pair> states = {now};
  uint64_t percent = 0;
  const auto change = [&] {
    const bool is_second = random() % 2 == 0;
    uint64_t& revision = is_second ? now.second : now.first;
    const std::string& id = ids[is_second ? 1 : 0];
    if (revision > 0 && random() % 3 == 0) {
      ASSERT_TRUE(Delete(id).ok());
      revision = 0;
    } else {
      revision = Replace(id);
    }
    states.insert(now);
  };
  // Before changes are held back, as this would wait for one that is.
  int parts = 0;
  shards_->OnPart([&] {
    if (++parts > 2 * (Shards::kLooks - 1)) return;
    while (random() % 100 < percent) change();
  });
  int tried = 0;
  std::set<Pair> read;
  for (int i = 0; i < 1500; ++i) {
    states = {now};
    parts = 0;
    percent = 10 + random() % 60;
    const std::vector<std::string> asked = {ids[0], ids[1]};
    std::optional<ShardsResolved> resolved;
    if (i % 3 == 0) {
      resolved = shards_->TryResolve(asked, {});
      tried += resolved.has_value() ? 1 : 0;
      if (!resolved.has_value()) continue;
    } else {
      auto waited = Resolve(asked);
      ASSERT_TRUE(waited.ok()) << waited.status();
      resolved = *std::move(waited);
    }
    const Pair pair = PairOf(*resolved);
    ASSERT_TRUE(states.contains(pair)) << pair.first << " " << pair.second << " in round " << i;
    read.insert(pair);
  }
  EXPECT_GT(tried, 20);
  EXPECT_GT(read.size(), 200);
}

TEST_F(ShardsTest, ABodyIsFoundInItsShardAndItsPiecesInTheirs) {
  const std::string body = IdIn(0, "body");
  const std::string hulls[] = {IdIn(1), IdIn(2)};
  Replace(hulls[0]);
  ASSERT_TRUE(PutBody(body, {hulls[0], hulls[1]}).ok());
  const PlacedLookup lookup;
  const std::vector<std::string> ids = {body, IdIn(2, "lone")};
  auto resolved = ResolvePlaced(*shards_, ids, lookup, {});
  ASSERT_TRUE(resolved.ok());
  EXPECT_THAT(std::string(resolved->hulls[0].status().message()), HasSubstr("piece 1"));
  Replace(hulls[1]);
  resolved = ResolvePlaced(*shards_, ids, lookup, {});
  ASSERT_TRUE(resolved.ok());
  ASSERT_TRUE(resolved->hulls[0].ok()) << resolved->hulls[0].status();
  EXPECT_EQ(resolved->hulls[0]->body->hulls.size(), 2);
  EXPECT_TRUE(absl::IsNotFound(resolved->hulls[1].status()));
  EXPECT_EQ(resolved->as_of.revisions, (ShardRevisions{{0, 1}, {1, 1}, {2, 1}}));
}

// The body names other hulls after its shard was looked at, and the hull that it named goes.
TEST_F(ShardsTest, ABodyAndItsPiecesAreOfOneInstant) {
  const std::string body = IdIn(0, "body");
  const std::string before = IdIn(1);
  const std::string after = IdIn(2);
  Replace(before);
  ASSERT_TRUE(PutBody(body, {before}).ok());
  bool is_due = true;
  shards_->OnPart([&] {
    if (!std::exchange(is_due, false)) return;
    Replace(after);
    ASSERT_TRUE(PutBody(body, {after}).ok());
    ASSERT_TRUE(Delete(before).ok());
  });
  const auto resolved = ResolvePlaced(*shards_, std::span(&body, 1), {}, {});
  ASSERT_TRUE(resolved.ok());
  EXPECT_FALSE(is_due);
  ASSERT_TRUE(resolved->hulls[0].ok()) << resolved->hulls[0].status();
  EXPECT_EQ(resolved->hulls[0]->body->body->hull_ids(), std::vector<std::string>{after});
}

TEST_F(ShardsTest, WhoAsksAgainIsToldWhatChangedSince) {
  const std::vector<std::string> ids = {IdIn(0), IdIn(1)};
  KnownInShards known;
  for (int i = 0; i < 3; ++i) {
    const Pair now = {Replace(ids[0]), Replace(ids[1])};
    const auto resolved = shards_->Refresh(ids, known, {}, {});
    ASSERT_TRUE(resolved.ok());
    EXPECT_EQ(PairOf(*resolved), now);
  }
}

TEST_F(ShardsTest, ARevisionOfEachShardMayBeAskedFor) {
  const std::vector<std::string> ids = {IdIn(0), IdIn(1)};
  Replace(ids[0]);
  Replace(ids[1]);
  ShardsPlan plan;
  plan.freshness.max_staleness = std::nullopt;
  plan.freshness.at_least = {{0, 1}, {1, 1}};
  EXPECT_TRUE(Resolve(ids, plan).ok());
  plan.freshness.at_least = {{0, 1}, {1, 2}};
  const absl::Status status = Resolve(ids, plan).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  // That of a shard that the call does not touch is none of its.
  plan.freshness.at_least = {{2, 9}};
  EXPECT_TRUE(Resolve(ids, plan).ok());
}

}  // namespace
}  // namespace hulld::server
