// Bodies by ID: put, get, list, delete, the namespace that they share with hulls, and durability.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <thread>

#include "server/store/rocksdb_store.h"
#include "server/store/store_keys.h"
#include "tests/server/hulls/body_fixture.h"

namespace hulld::server {
namespace body_service_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;

class BodyCalls : public BodyTest {};

std::string TextOf(const absl::Status& status) { return std::string(status.message()); }

TEST_F(BodyCalls, GetReturnsTheBodyThatWasPut) {
  const Client client = MakeClient();
  v1::PutBodyRequest request =
      BodyOf("cell/arm", {PlacementOf("cell/link", 0.1, -2, 1e300), PlacementOf("cell/box"),
                          PlacementOf("cell/link")});
  v1::Quaternion* const q = request.mutable_pieces(1)->mutable_pose()->mutable_rotation();
  q->set_w(3);
  q->set_z(-0.25);
  const auto put = client.PutBody(request);
  ASSERT_TRUE(put.ok()) << put.status();
  EXPECT_TRUE(put->created());
  EXPECT_EQ(put->body().piece_count(), 3u);
  EXPECT_EQ(put->body().revision(), put->header().revision());
  EXPECT_EQ(put->body().create_revision(), put->body().revision());
  const auto got = client.GetBody("cell/arm");
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->body().SerializeAsString(), put->body().SerializeAsString());
  ASSERT_EQ(got->pieces_size(), 3);
  EXPECT_EQ(got->pieces(0).hull_id(), "cell/link");
  EXPECT_EQ(got->pieces(0).pose().translation().z(), 1e300);
  EXPECT_EQ(got->pieces(1).hull_id(), "cell/box");
  EXPECT_EQ(got->pieces(1).pose().rotation().w(), 3);
  EXPECT_EQ(got->pieces(1).pose().rotation().z(), -0.25);
  EXPECT_EQ(got->pieces(2).pose().rotation().w(), 1);
}

TEST_F(BodyCalls, PuttingAgainReplacesAllPieces) {
  const auto first = PutBody("b", {PlacementOf("x"), PlacementOf("y")});
  const auto second = PutBody("b", {PlacementOf("z")});
  ASSERT_TRUE(second.ok());
  EXPECT_FALSE(second->created());
  EXPECT_EQ(second->body().create_revision(), first->body().create_revision());
  EXPECT_GT(second->body().revision(), first->body().revision());
  const auto got = MakeClient().GetBody("b");
  ASSERT_EQ(got->pieces_size(), 1);
  EXPECT_EQ(got->pieces(0).hull_id(), "z");
}

TEST_F(BodyCalls, ConditionsOnTheRevisionHold) {
  const Client client = MakeClient();
  EXPECT_TRUE(PutBody("b", {PlacementOf("x")}, 0).ok());
  const auto exists = PutBody("b", {PlacementOf("x")}, 0);
  EXPECT_TRUE(absl::IsAborted(exists.status()));
  EXPECT_EQ(ReasonOf(exists.status()), v1::ERROR_REASON_REVISION_MISMATCH);
  const uint64_t revision = client.GetBody("b")->body().revision();
  EXPECT_THAT(MetadataOf(exists.status(), "current_revision"), Optional(std::to_string(revision)));
  EXPECT_TRUE(PutBody("b", {PlacementOf("y")}, revision).ok());
  EXPECT_TRUE(absl::IsAborted(client.DeleteBody("b", revision).status()));
  EXPECT_TRUE(client.DeleteBody("b", revision + 1).ok());
  EXPECT_TRUE(absl::IsAborted(PutBody("b", {PlacementOf("y")}, 7).status()));
  EXPECT_EQ(ReasonOf(client.GetBody("b").status()), v1::ERROR_REASON_BODY_NOT_FOUND);
  EXPECT_EQ(ReasonOf(client.DeleteBody("b").status()), v1::ERROR_REASON_BODY_NOT_FOUND);
}

TEST_F(BodyCalls, MalformedBodiesAreRefusedAndNameThePiece) {
  v1::Placement bad = PlacementOf("x");
  bad.mutable_pose()->mutable_translation()->set_y(std::nan(""));
  EXPECT_THAT(TextOf(PutBody("b", {PlacementOf("x"), bad}).status()),
              HasSubstr("pieces[1].pose.translation.y is NaN"));
  EXPECT_THAT(TextOf(PutBody("b", {PlacementOf("a//b")}).status()),
              HasSubstr("pieces[0].hull_id \"a//b\" has an empty segment"));
  EXPECT_THAT(TextOf(PutBody("b", {}).status()), HasSubstr("pieces is empty"));
  EXPECT_THAT(TextOf(PutBody("b", {PlacementOf("b")}).status()), HasSubstr("is the body itself"));
  EXPECT_THAT(TextOf(PutBody("", {PlacementOf("x")}).status()), HasSubstr("body_id is empty"));
  Config config = TestConfig();
  config.limits.max_pieces_per_body = 2;
  Restart(config);
  const auto many = PutBody("b", {PlacementOf("x"), PlacementOf("x"), PlacementOf("x")});
  EXPECT_EQ(ReasonOf(many.status()), v1::ERROR_REASON_LIMIT_EXCEEDED);
  EXPECT_THAT(TextOf(many.status()), HasSubstr("--max-pieces-per-body"));
}

TEST_F(BodyCalls, HullsAndBodiesShareTheirIds) {
  Create("hull");
  const auto body = PutBody("hull", {PlacementOf("x")});
  EXPECT_TRUE(absl::IsAlreadyExists(body.status()));
  EXPECT_EQ(ReasonOf(body.status()), v1::ERROR_REASON_HULL_EXISTS);
  ASSERT_TRUE(PutBody("body", {PlacementOf("x")}).ok());
  const Client client = MakeClient();
  for (const bool if_absent : {false, true}) {
    const auto hull = client.CreateHull("body", if_absent);
    EXPECT_TRUE(absl::IsAlreadyExists(hull.status())) << hull.status();
    EXPECT_EQ(ReasonOf(hull.status()), v1::ERROR_REASON_BODY_EXISTS);
  }
  AppendOptions append;
  append.create_if_absent = true;
  EXPECT_EQ(ReasonOf(client.OpenAppend("body", append).status()), v1::ERROR_REASON_BODY_EXISTS);
  v1::ReplaceOpen open;
  open.set_hull_id("body");
  open.set_create_if_absent(true);
  EXPECT_EQ(ReasonOf(client
                         .ReplaceHull(open,
                                      [](const Client::PointSink& sink) {
                                        v1::PointBlock block;
                                        for (const double x : Cube()) block.add_xyz(x);
                                        return sink(block);
                                      })
                         .status()),
            v1::ERROR_REASON_BODY_EXISTS);
  EXPECT_THAT(TextOf(client.GetHull("body").status()),
              HasSubstr("is a body; this call requires a hull"));
  EXPECT_TRUE(absl::IsNotFound(client.DeleteHull("body").status()));
  for (const absl::Status& status :
       {client.DeleteBody("hull").status(), client.GetBody("hull").status()}) {
    EXPECT_EQ(ReasonOf(status), v1::ERROR_REASON_BODY_NOT_FOUND);
    EXPECT_THAT(TextOf(status), HasSubstr("is a hull, not a body"));
  }
  ASSERT_TRUE(client.DeleteBody("body").ok());
  EXPECT_TRUE(client.CreateHull("body").ok());
}

TEST_F(BodyCalls, ListsAreCountedAndPaged) {
  for (const char* id : {"a/2", "b/1", "a/1", "a/3"}) {
    ASSERT_TRUE(PutBody(id, {PlacementOf("x")}).ok());
  }
  Create("a/0");
  const auto ids = [](const v1::ListBodiesResponse& list) {
    std::vector<std::string> result;
    for (const v1::BodyInfo& body : list.bodies()) result.push_back(body.body_id());
    return result;
  };
  const Client client = MakeClient();
  EXPECT_THAT(ids(*client.ListAllBodies("")), ElementsAre("a/1", "a/2", "a/3", "b/1"));
  EXPECT_THAT(ids(*client.ListAllBodies("a/", 2)), ElementsAre("a/1", "a/2"));
  v1::ListBodiesRequest request;
  request.set_prefix("a/");
  request.set_page_size(2);
  auto page = client.ListBodies(request);
  EXPECT_THAT(ids(*page), ElementsAre("a/1", "a/2"));
  request.set_page_token(page->next_page_token());
  page = client.ListBodies(request);
  EXPECT_THAT(ids(*page), ElementsAre("a/3"));
  EXPECT_EQ(page->next_page_token(), "");
  EXPECT_EQ(client.GetStatus()->body_count(), 4u);
  EXPECT_EQ(client.GetStatus()->hull_count(), 1u);
}

TEST_F(BodyCalls, APageTokenIsValidOnlyForTheCallThatReturnedIt) {
  for (const char* id : {"a", "b"}) ASSERT_TRUE(PutBody(id, {PlacementOf("x")}).ok());
  for (const char* id : {"c", "d"}) Create(id);
  const Client client = MakeClient();
  v1::ListBodiesRequest bodies;
  v1::ListHullsRequest hulls;
  bodies.set_page_size(1);
  hulls.set_page_size(1);
  const auto body_page = client.ListBodies(bodies);
  const auto hull_page = client.ListHulls(hulls);
  ASSERT_TRUE(body_page.ok() && hull_page.ok());
  bodies.set_page_token(hull_page->next_page_token());
  hulls.set_page_token(body_page->next_page_token());
  for (const absl::Status& refused :
       {client.ListBodies(bodies).status(), client.ListHulls(hulls).status()}) {
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << refused;
    EXPECT_THAT(std::string(refused.message()), ::testing::HasSubstr("page_token belongs to"));
  }
}

TEST_F(BodyCalls, BodiesCountAmongHulls) {
  Config config = TestConfig();
  config.limits.max_hulls = 2;
  Restart(config);
  Create("h");
  ASSERT_TRUE(PutBody("b", {PlacementOf("h")}).ok());
  const auto third = PutBody("c", {PlacementOf("h")});
  EXPECT_THAT(TextOf(third.status()), HasSubstr("contains 1 hulls and 1 bodies; the limit is 2"));
  // A replacement does not add to the count.
  EXPECT_TRUE(PutBody("b", {PlacementOf("h"), PlacementOf("h")}).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(MakeClient().CreateHull("d").status()));
}

TEST_F(BodyCalls, BodiesCountAgainstTheMemoryLimit) {
  Config config = TestConfig();
  config.limits.memory_limit = 1 << 20;
  Restart(config);
  Put("cube", Cube());
  const std::vector<v1::Placement> pieces(10000, PlacementOf("cube"));
  ASSERT_TRUE(PutBody("first", pieces).ok());
  const auto second = PutBody("second", pieces);
  EXPECT_TRUE(absl::IsResourceExhausted(second.status()));
  EXPECT_THAT(TextOf(second.status()), HasSubstr("--memory-limit"));
  // Memory is also insufficient for queries: each call copies the pieces.
  EXPECT_TRUE(
      absl::IsResourceExhausted(CheckPair(PlacementOf("first"), PlacementOf("cube")).status()));
  // Refused or deleted bodies are no longer counted.
  ASSERT_TRUE(MakeClient().DeleteBody("first").ok());
  EXPECT_TRUE(PutBody("second", pieces).ok());
}

TEST_F(BodyCalls, ManyWritersOfOneBodyTakeTurns) {
  constexpr int kThreads = 4;
  constexpr int kPuts = 25;
  std::vector<std::set<uint64_t>> revisions(kThreads);
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      const Client client = MakeClient();
      for (int i = 0; i < kPuts; ++i) {
        const auto put = client.PutBody(BodyOf("b", {PlacementOf("x", t, i, 0)}));
        ASSERT_TRUE(put.ok()) << put.status();
        revisions[t].insert(put->body().revision());
        if (i % 10 == 9) client.DeleteBody("b").status().IgnoreError();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::set<uint64_t> all;
  for (const auto& own : revisions) all.insert(own.begin(), own.end());
  EXPECT_EQ(all.size(), kThreads * kPuts);
}

class DurableBodies : public BodyTest {
 protected:
  DurableBodies() {
    std::string name = ::testing::TempDir() + "hulld_bodies_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  ~DurableBodies() override { std::filesystem::remove_all(directory_); }
  Config DurableConfig() const {
    Config config = TestConfig();
    config.store = "rocksdb";
    config.data_dir = directory_ + "/data";
    return config;
  }
  void SetUp() override { Restart(DurableConfig()); }

  std::string directory_;
};

TEST_F(DurableBodies, SurviveARestart) {
  PutPair("pair");
  ASSERT_TRUE(PutBody("gone", {PlacementOf("cube")}).ok());
  ASSERT_TRUE(PutBody("pair", {PlacementOf("cube", 1, 2, 3), PlacementOf("late")}).ok());
  ASSERT_TRUE(MakeClient().DeleteBody("gone").ok());
  const auto before = MakeClient().GetBody("pair");
  Restart(DurableConfig());
  const auto after = MakeClient().GetBody("pair");
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_EQ(after->SerializeAsString(), before->SerializeAsString());
  EXPECT_TRUE(absl::IsNotFound(MakeClient().GetBody("gone").status()));
  EXPECT_TRUE(absl::IsAlreadyExists(MakeClient().CreateHull("pair").status()));
  EXPECT_EQ(MakeClient().ListAllBodies("")->bodies_size(), 1);
}

TEST_F(DurableBodies, ADamagedBodyIsNamedAndCanBeReplaced) {
  PutPair("pair");
  TearDown();
  {
    RocksDbOptions options;
    options.data_dir = DurableConfig().data_dir;
    const auto store = RocksDbStore::Open(options);
    ASSERT_TRUE(store.ok());
    ASSERT_TRUE((*store)->db().Put({}, BodyKey("pair"), "nonsense").ok());
  }
  Restart(DurableConfig());
  const Client client = MakeClient();
  const auto got = client.GetBody("pair");
  EXPECT_TRUE(absl::IsDataLoss(got.status()));
  EXPECT_EQ(ReasonOf(got.status()), v1::ERROR_REASON_BODY_DAMAGED);
  EXPECT_TRUE(client.ListAllBodies("")->bodies(0).damaged());
  const auto answer = CheckPair(PlacementOf("pair"), PlacementOf("cube"));
  EXPECT_EQ(ReasonOf(answer.status()), v1::ERROR_REASON_BODY_DAMAGED);
  EXPECT_TRUE(PutBody("pair", {PlacementOf("cube")}).ok());
  EXPECT_TRUE(client.GetBody("pair").ok());
  EXPECT_EQ(client.GetBody("pair")->body().create_revision(),
            client.GetBody("pair")->body().revision());
}

}  // namespace body_service_test
}  // namespace hulld::server
