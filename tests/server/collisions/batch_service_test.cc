#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace batch_service_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class BatchCall : public ServerTest {
 protected:
  struct Batch {
    grpc::Status status;
    // The first message, without columns.
    v1::BatchCheckCollisionsResponse head;
    std::vector<v1::Relation> relations;
    std::vector<v1::Rung> rungs;
    std::vector<v1::Axis> axes;
    std::vector<v1::Analysis> analyses;
    std::vector<v1::PairProblem> problems;
    std::vector<v1::Certificate> certificates;
    std::vector<double> separations;
    std::vector<double> separation_bounds;
    std::vector<double> witness_xyz;
    std::vector<double> normal_xyz;
    std::vector<double> normal_angle_bounds;
    std::vector<bool> within_clearance;
    int messages = 0;
    size_t largest_message = 0;
  };

  Batch Run(const v1::BatchCheckCollisionsRequest& request) {
    grpc::ClientContext context;
    auto stream = collisions_->BatchCheckCollisions(&context, request);
    Batch batch;
    v1::BatchCheckCollisionsResponse part;
    while (stream->Read(&part)) {
      if (batch.messages++ == 0) batch.head = part;
      EXPECT_EQ(part.first_pair(), batch.relations.size());
      const v1::AnswerColumns& columns = part.columns();
      EXPECT_EQ(columns.relations_size(), columns.rungs_size());
      batch.largest_message = std::max(batch.largest_message, part.ByteSizeLong());
      for (const int r : columns.relations())
        batch.relations.push_back(static_cast<v1::Relation>(r));
      for (const int r : columns.rungs()) batch.rungs.push_back(static_cast<v1::Rung>(r));
      batch.axes.insert(batch.axes.end(), columns.axes().begin(), columns.axes().end());
      batch.analyses.insert(batch.analyses.end(), columns.analyses().begin(),
                            columns.analyses().end());
      batch.certificates.insert(batch.certificates.end(), columns.certificates().begin(),
                                columns.certificates().end());
      batch.separations.insert(batch.separations.end(), columns.separations().begin(),
                               columns.separations().end());
      batch.separation_bounds.insert(batch.separation_bounds.end(),
                                     columns.separation_bounds().begin(),
                                     columns.separation_bounds().end());
      batch.witness_xyz.insert(batch.witness_xyz.end(), columns.witness_xyz().begin(),
                               columns.witness_xyz().end());
      batch.normal_xyz.insert(batch.normal_xyz.end(), columns.normal_xyz().begin(),
                              columns.normal_xyz().end());
      batch.normal_angle_bounds.insert(batch.normal_angle_bounds.end(),
                                       columns.normal_angle_bounds().begin(),
                                       columns.normal_angle_bounds().end());
      batch.within_clearance.insert(batch.within_clearance.end(),
                                    columns.within_clearance().begin(),
                                    columns.within_clearance().end());
      for (v1::PairProblem problem : columns.pair_problems()) {
        problem.set_row(part.first_pair() + problem.row());
        batch.problems.push_back(std::move(problem));
      }
    }
    batch.status = stream->Finish();
    return batch;
  }

  static void AddPair(v1::BatchCheckCollisionsRequest* request, uint32_t a, uint32_t b) {
    request->add_pairs(a);
    request->add_pairs(b);
  }

  void ExpectRefused(const v1::BatchCheckCollisionsRequest& request, grpc::StatusCode code,
                     const std::string& what) {
    const grpc::Status status = Run(request).status;
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  }

  // The first 1024 pairs are quick, so that answers start streaming; the rest would take hours.
  v1::BatchCheckCollisionsRequest EndlessBatch() {
    Put("cube", Cube());
    Put("ball", Sphere(700));
    v1::BatchCheckCollisionsRequest request;
    request.set_method(v1::METHOD_TEXTBOOK_SAT);
    *request.add_placements() = PlacementOf("cube");
    *request.add_placements() = PlacementOf("cube", 3);
    *request.add_placements() = PlacementOf("ball");
    *request.add_placements() = PlacementOf("ball", 0.5);
    for (int i = 0; i < 1024; ++i) AddPair(&request, 0, 1);
    for (int i = 0; i < 10'000; ++i) AddPair(&request, 2, 3);
    return request;
  }
};

// The table of the hulls of 20000 placements with long names exceeds 5 MB. A client need not accept
// messages above 4 MiB, and this one does not.
class LongTable : public BatchCall {
 protected:
  static constexpr int kPlacements = 20'000;

  void SetUp() override {
    BatchCall::SetUp();
    Put(there_, Cube());
  }

  template <typename Request>
  void AddPlacements(Request* request) const {
    for (int i = 0; i < kPlacements; ++i) {
      *request->add_placements() = PlacementOf(i % 3 == 0 ? missing_ : there_, 2.0 * i);
    }
  }

  // Expects that the parts form the table and are each of moderate size.
  template <typename Response>
  void CheckTable(const std::vector<Response>& parts) const {
    int placement = 0;
    uint32_t problem = 0;
    int with_hulls = 0;
    for (const Response& part : parts) {
      EXPECT_LT(part.ByteSizeLong(), size_t{5} << 18);
      EXPECT_EQ(part.has_header(), &part == &parts.front());
      with_hulls += part.hulls_size() > 0;
      for (const v1::HullVersion& hull : part.hulls()) {
        ASSERT_EQ(hull.hull_id(), placement % 3 == 0 ? "" : there_) << placement;
        ++placement;
      }
      for (const v1::PlacementProblem& found : part.placement_problems()) {
        ASSERT_EQ(found.placement(), problem);
        ASSERT_LT(found.placement(), static_cast<uint32_t>(placement));
        problem += 3;
      }
    }
    EXPECT_EQ(placement, kPlacements);
    EXPECT_EQ(problem, (kPlacements + 2) / 3 * 3);
    EXPECT_GT(with_hulls, 4);
  }

  const std::string there_ = std::string(250, 't');
  const std::string missing_ = std::string(250, 'm');
};

TEST_F(LongTable, ABatchArrivesInParts) {
  for (const bool any_pair : {false, true}) {
    v1::BatchCheckCollisionsRequest request;
    AddPlacements(&request);
    if (any_pair) {
      AddPair(&request, 1, 2);
      AddPair(&request, 0, kPlacements - 1);
      AddPair(&request, kPlacements - 1, kPlacements - 1);
    }
    grpc::ClientContext context;
    const auto stream = collisions_->BatchCheckCollisions(&context, request);
    std::vector<v1::BatchCheckCollisionsResponse> parts;
    v1::BatchCheckCollisionsResponse part;
    std::vector<int> relations;
    while (stream->Read(&part)) {
      EXPECT_EQ(part.first_pair(), relations.size());
      relations.insert(relations.end(), part.columns().relations().begin(),
                       part.columns().relations().end());
      parts.push_back(part);
    }
    const grpc::Status status = stream->Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
    CheckTable(parts);
    if (!any_pair) continue;
    EXPECT_THAT(relations, ElementsAre(v1::RELATION_SEPARATED, v1::RELATION_UNSPECIFIED,
                                       v1::RELATION_OVERLAPPING));
  }
}

TEST_F(LongTable, ASceneArrivesInParts) {
  v1::FindCollisionsRequest request;
  AddPlacements(&request);
  // The second placement against all other placements.
  request.set_movers(2);
  request.mutable_wanted()->set_clearance(1);
  grpc::ClientContext context;
  const auto stream = collisions_->FindCollisions(&context, request);
  std::vector<v1::FindCollisionsResponse> parts;
  v1::FindCollisionsResponse part;
  std::vector<uint32_t> pairs;
  int hulls = 0;
  while (stream->Read(&part)) {
    hulls += part.hulls_size();
    if (part.pairs_size() > 0) {
      EXPECT_EQ(hulls, kPlacements);
    }
    pairs.insert(pairs.end(), part.pairs().begin(), part.pairs().end());
    parts.push_back(part);
  }
  const grpc::Status status = stream->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  CheckTable(parts);
  EXPECT_THAT(pairs, ElementsAre(1, 2));
  EXPECT_TRUE(parts.back().has_totals());
}

TEST_F(LongTable, AStreamArrivesInParts) {
  grpc::ClientContext context;
  const auto stream = collisions_->StreamCollisions(&context);
  v1::StreamCollisionsRequest request;
  AddPlacements(request.mutable_open());
  request.mutable_open()->add_pairs(1);
  request.mutable_open()->add_pairs(2);
  // Opens the stream, then refreshes the hulls.
  for (uint64_t message = 0; message < 2; ++message) {
    ASSERT_TRUE(stream->Write(request));
    std::vector<v1::StreamCollisionsResponse> parts;
    std::vector<int> relations;
    v1::StreamCollisionsResponse part;
    do {
      ASSERT_TRUE(stream->Read(&part)) << stream->Finish().error_message();
      EXPECT_EQ(part.update(), message);
      relations.insert(relations.end(), part.columns().relations().begin(),
                       part.columns().relations().end());
      parts.push_back(part);
    } while (!part.last());
    CheckTable(parts);
    if (message == 0) {
      EXPECT_THAT(relations, ElementsAre(v1::RELATION_SEPARATED));
    }
    request.mutable_update()->set_refresh_hulls(true);
  }
  // Without a refresh no table is sent.
  request.mutable_update()->set_refresh_hulls(false);
  ASSERT_TRUE(stream->Write(request));
  v1::StreamCollisionsResponse part;
  ASSERT_TRUE(stream->Read(&part));
  EXPECT_TRUE(part.last());
  EXPECT_EQ(part.hulls_size(), 0);
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&part));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(BatchCall, EqualsSingleChecksPairByPair) {
  Put("cube", Cube());
  Put("ball", Sphere(30));
  Put("square", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  Create("empty");
  v1::BatchCheckCollisionsRequest request;
  request.mutable_wanted()->set_axis(true);
  request.mutable_wanted()->set_analysis(true);
  request.mutable_wanted()->set_certificate(true);
  request.mutable_wanted()->set_separation(true);
  request.mutable_wanted()->set_witness(true);
  request.mutable_wanted()->set_normal(true);
  request.mutable_wanted()->set_clearance(0.25);
  std::mt19937 random(5);
  std::uniform_int_distribution<int> half_steps(-2, 2);
  for (int i = 0; i < 24; ++i) {
    constexpr const char* kIds[] = {"cube", "ball", "square", "empty"};
    *request.add_placements() = PlacementOf(kIds[i % 4], half_steps(random) * 0.5,
                                            half_steps(random) * 0.5, half_steps(random) * 0.5);
  }
  for (uint32_t a = 0; a < 24; ++a) {
    for (uint32_t b = 0; b < 24; ++b) AddPair(&request, a, b);
  }
  for (const v1::Method method : {v1::METHOD_CERTIFIED_SEARCH, v1::METHOD_TEXTBOOK_SAT}) {
    request.set_method(method);
    const Batch batch = Run(request);
    ASSERT_TRUE(batch.status.ok()) << batch.status.error_message();
    ASSERT_EQ(batch.relations.size(), 24 * 24);
    ASSERT_EQ(batch.axes.size(), 24 * 24);
    ASSERT_EQ(batch.analyses.size(), 24 * 24);
    ASSERT_EQ(batch.certificates.size(), 24 * 24);
    ASSERT_EQ(batch.separations.size(), 24 * 24);
    ASSERT_EQ(batch.separation_bounds.size(), 24 * 24);
    ASSERT_EQ(batch.witness_xyz.size(), 6 * 24 * 24);
    ASSERT_EQ(batch.normal_xyz.size(), 3 * 24 * 24);
    ASSERT_EQ(batch.normal_angle_bounds.size(), 24 * 24);
    ASSERT_EQ(batch.within_clearance.size(), 24 * 24);
    EXPECT_EQ(batch.head.hulls(1).revision(), Get("ball").hull().revision());
    v1::BatchCheckCollisionsRequest relations_alone = request;
    relations_alone.clear_wanted();
    EXPECT_EQ(Run(relations_alone).relations, batch.relations);
    int counts[4] = {};
    for (size_t i = 0; i < batch.relations.size(); ++i) {
      v1::CheckCollisionRequest single;
      *single.mutable_a() = request.placements(static_cast<int>(request.pairs(2 * i)));
      *single.mutable_b() = request.placements(static_cast<int>(request.pairs(2 * i + 1)));
      single.set_method(method);
      *single.mutable_wanted() = request.wanted();
      const v1::CheckCollisionResponse answer = Check(single);
      ASSERT_EQ(batch.relations[i], answer.relation()) << i;
      ASSERT_EQ(batch.rungs[i], answer.rung()) << i;
      ASSERT_EQ(batch.axes[i].DebugString(), answer.axis().DebugString()) << i;
      ASSERT_EQ(batch.analyses[i].axes_tested(), answer.analysis().axes_tested()) << i;
      ASSERT_EQ(batch.certificates[i].DebugString(), answer.certificate().DebugString()) << i;
      ASSERT_EQ(batch.separations[i], answer.separation().value()) << i;
      ASSERT_EQ(batch.separation_bounds[i], answer.separation().bound()) << i;
      ASSERT_EQ(batch.within_clearance[i], answer.within_clearance()) << i;
      if (answer.has_witness()) {
        ASSERT_EQ(batch.witness_xyz[6 * i + 4], answer.witness().point_b().y()) << i;
      } else {
        ASSERT_TRUE(std::isnan(batch.witness_xyz[6 * i])) << i;
      }
      ASSERT_EQ(answer.has_normal(), answer.has_witness()) << i;
      if (answer.has_normal()) {
        ASSERT_EQ(batch.normal_xyz[3 * i + 1], answer.normal().direction().y()) << i;
        ASSERT_EQ(batch.normal_angle_bounds[i], answer.normal().angle_bound()) << i;
      } else {
        ASSERT_TRUE(std::isnan(batch.normal_xyz[3 * i])) << i;
        ASSERT_TRUE(std::isnan(batch.normal_angle_bounds[i])) << i;
      }
      ++counts[batch.relations[i]];
    }
    EXPECT_EQ(counts[v1::RELATION_UNSPECIFIED], 0);
    EXPECT_GT(counts[v1::RELATION_SEPARATED], 100);
    EXPECT_GT(counts[v1::RELATION_TOUCHING], 20);
    EXPECT_GT(counts[v1::RELATION_OVERLAPPING], 20);
  }
}

TEST_F(BatchCall, AnEmptyBatchAnswersWithItsHeader) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  const Batch batch = Run(request);
  EXPECT_TRUE(batch.status.ok());
  EXPECT_EQ(batch.messages, 1);
  EXPECT_EQ(batch.head.hulls_size(), 1);
  EXPECT_GT(batch.head.header().revision(), 0);
  EXPECT_TRUE(Run({}).status.ok());
}

TEST_F(BatchCall, ProblemsOfAPlacementAreListedOnceAndItsPairsAreUnspecified) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("missing");
  *request.add_placements() = PlacementOf("not valid");
  *request.add_placements() = PlacementOf("cube", std::numeric_limits<double>::quiet_NaN());
  for (uint32_t other : {0, 1, 2, 3, 1}) AddPair(&request, 0, other);
  const Batch batch = Run(request);
  ASSERT_TRUE(batch.status.ok()) << batch.status.error_message();
  EXPECT_THAT(batch.relations,
              ::testing::ElementsAre(v1::RELATION_OVERLAPPING, v1::RELATION_UNSPECIFIED,
                                     v1::RELATION_UNSPECIFIED, v1::RELATION_UNSPECIFIED,
                                     v1::RELATION_UNSPECIFIED));
  ASSERT_EQ(batch.head.placement_problems_size(), 3);
  const auto expect = [&](int i, uint32_t placement, grpc::StatusCode code,
                          const std::string& what) {
    EXPECT_EQ(batch.head.placement_problems(i).placement(), placement);
    EXPECT_EQ(batch.head.placement_problems(i).code(), code);
    EXPECT_THAT(batch.head.placement_problems(i).message(), HasSubstr(what));
  };
  expect(0, 1, grpc::StatusCode::NOT_FOUND, "hull \"missing\" not found");
  expect(1, 2, grpc::StatusCode::INVALID_ARGUMENT, "placements[2].hull_id \"not valid\"");
  expect(2, 3, grpc::StatusCode::INVALID_ARGUMENT, "placements[3].pose.translation.x is NaN");
  EXPECT_EQ(batch.head.hulls(0).hull_id(), "cube");
  EXPECT_EQ(batch.head.hulls(1).hull_id(), "");
  EXPECT_TRUE(batch.problems.empty());
}

TEST_F(BatchCall, ProblemsOfAPairNameThePair) {
  Config config = TestConfig();
  config.limits.max_textbook_axes = 200;
  Restart(config);
  Put("cube", Cube());
  Put("ball", Sphere(30));
  v1::BatchCheckCollisionsRequest request;
  request.set_method(v1::METHOD_TEXTBOOK_SAT);
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("ball");
  AddPair(&request, 0, 0);
  AddPair(&request, 0, 1);
  const Batch batch = Run(request);
  ASSERT_TRUE(batch.status.ok());
  EXPECT_THAT(batch.relations,
              ::testing::ElementsAre(v1::RELATION_OVERLAPPING, v1::RELATION_UNSPECIFIED));
  ASSERT_EQ(batch.problems.size(), 1);
  EXPECT_EQ(batch.problems[0].row(), 1);
  EXPECT_EQ(batch.problems[0].code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(batch.problems[0].message(), HasSubstr("(--max-textbook-axes)"));
}

TEST_F(BatchCall, AMalformedBatchFailsAsAWhole) {
  Config config = TestConfig();
  config.limits.max_pairs_per_batch = 2;
  Restart(config);
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  request.add_pairs(0);
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT,
                "pairs has an odd number of indices, 1;");
  request.add_pairs(1);
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT,
                "pairs[1] is 1, but there is 1 placement");
  request.set_pairs(1, 0);
  EXPECT_TRUE(Run(request).status.ok());
  request.set_method(static_cast<v1::Method>(9));
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "method is 9");
  request.set_method(v1::METHOD_UNSPECIFIED);
  for (int i = 0; i < 2; ++i) AddPair(&request, 0, 0);
  ExpectRefused(request, grpc::StatusCode::RESOURCE_EXHAUSTED,
                "the batch has 3 pairs; the limit is 2 (--max-pairs-per-batch)");
}

TEST_F(BatchCall, LongBatchesStreamInMessagesOfAMebibyte) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  request.mutable_wanted()->set_axis(true);
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("cube", 3);
  request.mutable_wanted()->set_certificate(true);
  request.mutable_wanted()->set_separation(true);
  constexpr size_t kPairs = 20'000;
  for (size_t i = 0; i < kPairs; ++i) AddPair(&request, i % 2, 1);
  const Batch batch = Run(request);
  ASSERT_TRUE(batch.status.ok());
  ASSERT_EQ(batch.relations.size(), kPairs);
  EXPECT_GT(batch.messages, 2);
  EXPECT_LT(batch.largest_message, (1 << 20) + 4096);
  for (size_t i = 0; i < kPairs; ++i) {
    ASSERT_EQ(batch.relations[i], i % 2 == 0 ? v1::RELATION_SEPARATED : v1::RELATION_OVERLAPPING);
    ASSERT_EQ(batch.axes[i].kind() != v1::AXIS_KIND_UNSPECIFIED, i % 2 == 0);
  }
}

TEST_F(BatchCall, AMillionPairsFitInOneRequest) {
  Put("point", {0, 0, 0});
  v1::BatchCheckCollisionsRequest request;
  for (int i = 0; i < 20'000; ++i) *request.add_placements() = PlacementOf("point", i);
  for (uint32_t i = 0; i < 1'000'000; ++i) AddPair(&request, i % 20'000, 19'999);
  ASSERT_GT(request.ByteSizeLong(), 4u << 20);
  const Batch batch = Run(request);
  ASSERT_TRUE(batch.status.ok()) << batch.status.error_message();
  EXPECT_EQ(std::count(batch.relations.begin(), batch.relations.end(), v1::RELATION_TOUCHING), 50);
  EXPECT_EQ(std::count(batch.relations.begin(), batch.relations.end(), v1::RELATION_SEPARATED),
            999'950);
}

TEST_F(BatchCall, ConflictingOptionsFailTheWholeCall) {
  Put("cube", Cube());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("cube");
  AddPair(&request, 0, 0);
  request.set_tolerance(0.5);
  EXPECT_TRUE(Run(request).status.ok());
  request.mutable_wanted()->set_witness(true);
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT,
                "tolerance is 0.5, but wanted.witness needs the exact relation");
  request.set_tolerance(std::numeric_limits<double>::quiet_NaN());
  ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "tolerance is NaN");
}

// Like the previous test, but requests details of every pair, at an unpredictable cost.
TEST_F(BatchCall, CancellingEndsALongBatchWithDetails) {
  Put("ball", Sphere(2000));
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("ball");
  *request.add_placements() = PlacementOf("ball", 0.5);
  request.mutable_wanted()->set_separation(true);
  request.mutable_wanted()->set_certificate(true);
  for (int i = 0; i < 900'000; ++i) AddPair(&request, 0, 1);
  grpc::ClientContext context;
  auto stream = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  ASSERT_TRUE(stream->Read(&part));
  context.TryCancel();
  while (stream->Read(&part)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

TEST_F(BatchCall, CancellingEndsALongBatch) {
  const v1::BatchCheckCollisionsRequest request = EndlessBatch();
  grpc::ClientContext context;
  auto stream = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  ASSERT_TRUE(stream->Read(&part));
  EXPECT_GT(part.columns().relations_size(), 0);
  context.TryCancel();
  while (stream->Read(&part)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  // The server stops computing; otherwise this call would run for hours.
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

TEST_F(BatchCall, ADeadlineEndsALongBatch) {
  const v1::BatchCheckCollisionsRequest request = EndlessBatch();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  auto stream = collisions_->BatchCheckCollisions(&context, request);
  v1::BatchCheckCollisionsResponse part;
  while (stream->Read(&part)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  server_->BeginDrain();
  EXPECT_TRUE(server_->WaitIdle(std::chrono::minutes(5)));
}

TEST_F(BatchCall, BatchesTakeTurns) {
  Put("cube", Cube());
  // One pair of these finishes quickly; all of them do not.
  Put("small", Sphere(100));
  v1::BatchCheckCollisionsRequest endless;
  endless.set_method(v1::METHOD_TEXTBOOK_SAT);
  *endless.add_placements() = PlacementOf("small");
  *endless.add_placements() = PlacementOf("small", 0.5);
  for (int i = 0; i < 900'000; ++i) AddPair(&endless, 0, 1);
  grpc::ClientContext context;
  auto stream = collisions_->BatchCheckCollisions(&context, endless);
  v1::BatchCheckCollisionsResponse part;
  ASSERT_TRUE(stream->Read(&part));
  v1::BatchCheckCollisionsRequest quick;
  *quick.add_placements() = PlacementOf("cube");
  AddPair(&quick, 0, 0);
  EXPECT_TRUE(Run(quick).status.ok());
  context.TryCancel();
  while (stream->Read(&part)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

// Formerly, an axis across wide facets shared a message with the preceding answers and the table of
// hulls, which exceeded every client's limit.
TEST_F(BatchCall, MessagesStayBelowFourMebibytes) {
  constexpr int kCorners = Config::kMaxFeatureVertices;
  Create("wide");
  Appender writer(*hulls_, "wide", "w");
  Coordinates parabola;
  for (int i = 0; i < kCorners; ++i) {
    parabola.insert(parabola.end(), {i - 0.5 * kCorners, (i - 0.5 * kCorners) * i, 0.0});
  }
  ASSERT_TRUE(writer.Append(1, parabola).has_value());
  ASSERT_TRUE(writer.Finish().ok());
  Put("cube", Cube());
  const std::string long_id(Config::kMaxIdCharacters, 'c');
  Put(long_id, Cube());

  v1::BatchCheckCollisionsRequest request;
  request.mutable_wanted()->set_axis(true);
  *request.add_placements() = PlacementOf("wide");
  *request.add_placements() = PlacementOf("wide", 0, 0, 1);
  *request.add_placements() = PlacementOf("cube");
  *request.add_placements() = PlacementOf("cube", 2);
  // A table of about 1 MiB.
  for (int i = 0; i < 3000; ++i) *request.add_placements() = PlacementOf(long_id);
  AddPair(&request, 0, 1);
  // Answers of about 1 MiB.
  for (int i = 0; i < 4000; ++i) AddPair(&request, 2, 3);
  AddPair(&request, 0, 1);
  const Batch batch = Run(request);
  ASSERT_TRUE(batch.status.ok()) << batch.status.error_message();
  ASSERT_EQ(batch.axes.size(), 4002u);
  EXPECT_EQ(batch.axes.front().feature_a().vertex_indices_size(), kCorners);
  EXPECT_EQ(batch.axes.back().feature_b().vertex_indices_size(), kCorners);
  EXPECT_GT(batch.largest_message, 3u << 20);
  EXPECT_LT(batch.largest_message, 4u << 20);

  v1::StreamCollisionsRequest open;
  *open.mutable_open()->mutable_placements() = request.placements();
  *open.mutable_open()->mutable_pairs() = request.pairs();
  *open.mutable_open()->mutable_wanted() = request.wanted();
  grpc::ClientContext context;
  const auto stream = collisions_->StreamCollisions(&context);
  ASSERT_TRUE(stream->Write(open));
  v1::StreamCollisionsResponse part;
  int answers = 0;
  while (stream->Read(&part)) {
    answers += part.pairs_size();
    EXPECT_LT(part.ByteSizeLong(), 4u << 20);
    if (part.last()) stream->WritesDone();
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(answers, 4002);
}

}  // namespace batch_service_test
}  // namespace hulld::server
