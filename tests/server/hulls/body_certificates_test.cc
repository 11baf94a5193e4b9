// Certificates of bodies: answers of single calls, checked by client/verify alone.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/verify/answer_check.h"
#include "tests/server/hulls/body_fixture.h"

namespace hulld::server {
namespace body_certificates_test {

using ::testing::HasSubstr;

class BodyCertificates : public BodyTest {
 protected:
  static v1::CheckCollisionRequest Query(const v1::Placement& a, const v1::Placement& b) {
    v1::CheckCollisionRequest request;
    *request.mutable_a() = a;
    *request.mutable_b() = b;
    request.mutable_wanted()->set_certificate(true);
    return request;
  }

  // Returns the verified answer.
  v1::CheckCollisionResponse Prove(const v1::CheckCollisionRequest& request) const {
    const auto verified = CheckCollisionVerified(MakeClient(), request);
    EXPECT_TRUE(verified.ok()) << verified.status();
    if (!verified.ok()) return {};
    EXPECT_EQ(verified->verification.verdict, Verdict::kValid) << verified->verification.reason;
    EXPECT_FALSE(verified->response.has_certificate());
    return verified->response;
  }

  Verification Verify(const v1::CheckCollisionRequest& request,
                      const v1::CheckCollisionResponse& response) const {
    const Client client = MakeClient();
    AnswerChecker checker(client);
    const auto verification = checker.Check(request, response);
    EXPECT_TRUE(verification.ok()) << verification.status();
    return verification.ok() ? *verification : Verification();
  }

  // Puts a row of unit cubes, 2 apart along x, and a row across it.
  void PutRows(int count) {
    Put("cube", Cube());
    std::vector<v1::Placement> pieces;
    for (int i = 0; i < count; ++i) pieces.push_back(PlacementOf("cube", 2.0 * i, 0, 0));
    ASSERT_TRUE(PutBody("row", pieces).ok());
  }

  static v1::Placement Turned(v1::Placement placement) {
    v1::Quaternion* const q = placement.mutable_pose()->mutable_rotation();
    q->set_w(0.3);
    q->set_x(-0.7);
    q->set_y(0.2);
    q->set_z(0.9);
    return placement;
  }
};

TEST_F(BodyCertificates, EveryRelationIsProven) {
  PutRows(30);
  const auto overlap = Prove(Query(PlacementOf("row"), PlacementOf("row", 3.5, 0.5, 0)));
  EXPECT_EQ(overlap.relation(), v1::RELATION_OVERLAPPING);
  ASSERT_EQ(overlap.piece_certificates_size(), 1);
  EXPECT_EQ(overlap.piece_certificates(0).piece_a(), overlap.piece_a().index());
  EXPECT_EQ(overlap.piece_certificates(0).piece_b(), overlap.piece_b().index());
  ASSERT_EQ(overlap.piece_hulls_size(), 1);
  EXPECT_EQ(overlap.piece_hulls(0).hull_id(), "cube");
  EXPECT_EQ(overlap.piece_hulls(0).revision(), Get("cube").hull().revision());

  const auto touching = Prove(Query(PlacementOf("row"), PlacementOf("row", 0, 1, 0)));
  EXPECT_EQ(touching.relation(), v1::RELATION_TOUCHING);
  EXPECT_EQ(touching.piece_certificates_size(), 30);

  // Under a common rotation, the boxes intersect but the hulls do not.
  const auto apart =
      Prove(Query(Turned(PlacementOf("row")), Turned(PlacementOf("row", 0.8, 0.8, 0.8))));
  EXPECT_EQ(apart.relation(), v1::RELATION_SEPARATED);
  EXPECT_GT(apart.piece_certificates_size(), 10);
  EXPECT_FALSE(apart.has_piece_a());

  const auto far = Prove(Query(PlacementOf("row"), PlacementOf("row", 0, 9, 0)));
  EXPECT_EQ(far.relation(), v1::RELATION_SEPARATED);
  EXPECT_EQ(far.piece_certificates_size(), 0);
}

TEST_F(BodyCertificates, HullsWithBodiesAndDetailsWithCertificates) {
  PutRows(3);
  Put("probe", Cube());
  v1::CheckCollisionRequest request = Query(PlacementOf("probe", 2, 1, 0), PlacementOf("row"));
  request.mutable_wanted()->set_separation(true);
  request.mutable_wanted()->set_axis(true);
  const auto touching = Prove(request);
  EXPECT_EQ(touching.relation(), v1::RELATION_TOUCHING);
  EXPECT_FALSE(touching.has_piece_a());
  EXPECT_EQ(touching.piece_b().index(), 1u);
  EXPECT_EQ(touching.separation().value(), 0);
  EXPECT_TRUE(touching.has_axis());
  std::set<std::string> hulls;
  for (const v1::HullVersion& hull : touching.piece_hulls()) hulls.insert(hull.hull_id());
  EXPECT_EQ(hulls, (std::set<std::string>{"cube", "probe"}));
}

TEST_F(BodyCertificates, PosesComposeExactly) {
  Put("cube", Cube());
  ASSERT_TRUE(PutBody("left", {PlacementOf("cube", 0.25, 0.2, 0.3)}).ok());
  ASSERT_TRUE(PutBody("right", {PlacementOf("cube", 1.25, 0.2, 0.3)}).ok());
  const auto touching = Prove(Query(Turned(PlacementOf("left", 17.3, -4.1, 1e6)),
                                    Turned(PlacementOf("right", 17.3, -4.1, 1e6))));
  EXPECT_EQ(touching.relation(), v1::RELATION_TOUCHING);
}

TEST_F(BodyCertificates, AlteredCertificatesAreRefused) {
  PutRows(3);
  const v1::CheckCollisionRequest request = Query(PlacementOf("row"), PlacementOf("row", 0, 1, 0));
  const v1::CheckCollisionResponse proven = Prove(request);
  ASSERT_EQ(proven.piece_certificates_size(), 3);
  const auto refused = [&](const v1::CheckCollisionResponse& altered) {
    const Verification verification = Verify(request, altered);
    EXPECT_EQ(verification.verdict, Verdict::kInvalid);
    return verification.reason;
  };
  v1::CheckCollisionResponse altered = proven;
  altered.mutable_piece_certificates()->DeleteSubrange(2, 1);
  EXPECT_THAT(refused(altered), HasSubstr("pieces 2 of A and 2 of B have no certificate"));
  altered = proven;
  altered.mutable_piece_certificates(1)->set_piece_b(2);
  EXPECT_THAT(refused(altered), HasSubstr("pieces 1 of A and 2 of B"));
  altered = proven;
  altered.set_relation(v1::RELATION_SEPARATED);
  EXPECT_THAT(refused(altered), HasSubstr("pieces 0 of A and 0 of B are RELATION_TOUCHING"));
  altered = proven;
  altered.mutable_piece_b()->set_index(1);
  EXPECT_THAT(refused(altered), HasSubstr("no certificate shows that"));
  altered = proven;
  altered.clear_piece_hulls();
  EXPECT_EQ(Verify(request, altered).verdict, Verdict::kCannotCheck);
  *altered.add_piece_hulls() = proven.piece_hulls(0);
  altered.mutable_piece_hulls(0)->set_hull_id("other");
  EXPECT_THAT(refused(altered), HasSubstr("piece 0 of body row is hull cube"));
  // A pose that the query did not have.
  v1::CheckCollisionRequest moved = request;
  moved.mutable_b()->mutable_pose()->mutable_translation()->set_y(1.5);
  EXPECT_EQ(Verify(moved, proven).verdict, Verdict::kInvalid);
}

TEST_F(BodyCertificates, AChangedHullMakesACertificateUncheckable) {
  PutRows(3);
  Put("probe", Cube());
  const v1::CheckCollisionRequest request =
      Query(PlacementOf("row"), PlacementOf("probe", 0, 1, 0));
  const v1::CheckCollisionResponse proven = Prove(request);
  ASSERT_TRUE(PutBody("row", {PlacementOf("cube")}).ok());
  Verification later = Verify(request, proven);
  EXPECT_EQ(later.verdict, Verdict::kMoved);
  EXPECT_THAT(later.reason, HasSubstr("body row is at revision"));
  const v1::CheckCollisionResponse again = Prove(request);
  ::hulld::server::Appender appender(*hulls_, "cube", "grow");
  ASSERT_TRUE(appender.Append(1, {3, 0.5, 0.5}).has_value());
  ASSERT_TRUE(appender.Finish().ok());
  later = Verify(request, again);
  EXPECT_EQ(later.verdict, Verdict::kMoved);
  EXPECT_THAT(later.reason, HasSubstr("hull cube is at revision"));
  ASSERT_TRUE(MakeClient().DeleteBody("row").ok());
  EXPECT_THAT(Verify(request, again).reason, HasSubstr("body row was deleted"));
}

TEST_F(BodyCertificates, TooManyAreRefusedAndTheLimitIsNamed) {
  Put("cube", Cube());
  std::vector<v1::Placement> pieces(100, PlacementOf("cube"));
  ASSERT_TRUE(PutBody("heap", pieces).ok());
  // 10000 pairs touch.
  const auto many =
      MakeClient().CheckCollision(Query(PlacementOf("heap"), PlacementOf("heap", 1, 0, 0)));
  EXPECT_TRUE(absl::IsResourceExhausted(many.status()));
  EXPECT_EQ(ReasonOf(many.status()), v1::ERROR_REASON_PROOF_TOO_LARGE);
  EXPECT_THAT(MetadataOf(many.status(), "limit"), testing::Optional(std::string("8192")));
  EXPECT_THAT(std::string(many.status().message()), HasSubstr("more than 8192 pairs of pieces"));
  // 8100 pairs touch, and fit.
  ASSERT_TRUE(PutBody("less", std::vector<v1::Placement>(81, PlacementOf("cube"))).ok());
  const auto fits =
      MakeClient().CheckCollision(Query(PlacementOf("heap"), PlacementOf("less", 1, 0, 0)));
  ASSERT_TRUE(fits.ok()) << fits.status();
  EXPECT_EQ(fits->piece_certificates_size(), 8100);
  EXPECT_LT(fits->ByteSizeLong(), size_t{4} << 20);
}

// Rows of a batch, stream, or scene, checked like single answers.
class BodyProofs : public BodyCertificates {
 protected:
  // Expects that every row is answered and proven. `placement_of`: index into the call's
  // placements; `pairs`: the pairs of the rows. Hulls, including those of pieces, are the whole
  // call's. Returns the number of rows with certificates of pieces.
  int ExpectProven(const std::vector<v1::Placement>& placements, const std::vector<uint32_t>& pairs,
                   const std::vector<v1::HullVersion>& hulls,
                   const std::vector<v1::HullVersion>& piece_hulls,
                   const v1::AnswerColumns& columns) const {
    const Client client = MakeClient();
    AnswerChecker checker(client);
    HullVersions versions;
    for (const v1::HullVersion& hull : piece_hulls) {
      EXPECT_TRUE(versions.emplace(hull.hull_id(), &hull).second) << "reported twice";
    }
    EXPECT_EQ(static_cast<size_t>(columns.relations_size()), pairs.size() / 2);
    EXPECT_EQ(columns.certificates_size(), columns.relations_size());
    int proofs = 0;
    for (int row = 0; row < columns.relations_size(); ++row) {
      const uint32_t a = pairs[2 * static_cast<size_t>(row)];
      const uint32_t b = pairs[2 * static_cast<size_t>(row) + 1];
      const v1::PieceProof* proof = nullptr;
      for (const v1::PieceProof& one : columns.piece_proofs()) {
        if (one.row() == static_cast<uint64_t>(row)) proof = &one;
      }
      const auto piece = [&](int side) {
        const int32_t index = columns.pieces(2 * row + side);
        return index < 0 ? std::nullopt : std::optional(static_cast<uint32_t>(index));
      };
      const absl::StatusOr<Verification> verified =
          proof == nullptr
              ? checker.Check(CheckedAnswer{placements[a], placements[b], columns.relations(row),
                                            columns.certificates(row), hulls[a], hulls[b]})
              : checker.Check(CheckedBodies{placements[a], placements[b], columns.relations(row),
                                            hulls[a], hulls[b], proof->certificates(), versions,
                                            piece(0), piece(1)});
      EXPECT_TRUE(verified.ok()) << verified.status();
      if (!verified.ok()) return 0;
      EXPECT_EQ(verified->verdict, Verdict::kValid) << "row " << row << ": " << verified->reason;
      if (proof != nullptr) ++proofs;
    }
    return proofs;
  }

  // Proofs refer to rows of their own message.
  template <typename Message>
  static void Append(const Message& part, Message* all) {
    const int rows = all->columns().relations_size();
    const int proofs = all->columns().piece_proofs_size();
    all->MergeFrom(part);
    for (int i = proofs; i < all->columns().piece_proofs_size(); ++i) {
      v1::PieceProof* const proof = all->mutable_columns()->mutable_piece_proofs(i);
      EXPECT_LT(proof->row(), static_cast<uint64_t>(part.columns().relations_size()));
      proof->set_row(proof->row() + static_cast<uint64_t>(rows));
    }
  }
  template <typename Message>
  static std::vector<v1::HullVersion> HullsOf(const Message& message) {
    return {message.hulls().begin(), message.hulls().end()};
  }
  template <typename Message>
  static std::vector<v1::HullVersion> PieceHullsOf(const Message& message) {
    return {message.piece_hulls().begin(), message.piece_hulls().end()};
  }
  // Two rows, a rotated row, and two cubes that are not bodies.
  std::vector<v1::Placement> Cell() {
    PutRows(5);
    Put("probe", Cube());
    return {PlacementOf("row"), PlacementOf("row", 0, 1, 0),
            Turned(PlacementOf("row", 0.8, 0.8, 0.8)), PlacementOf("probe", 4.5, 0.5, 0),
            PlacementOf("probe", 5.5, 0.5, 0)};
  }
};

TEST_F(BodyProofs, ProofsOfBatchesAreChecked) {
  const std::vector<v1::Placement> cell = Cell();
  v1::BatchCheckCollisionsRequest request;
  for (const v1::Placement& placement : cell) *request.add_placements() = placement;
  std::vector<uint32_t> pairs;
  for (uint32_t b = 0; b < cell.size(); ++b) {
    for (uint32_t a = 0; a < b; ++a) pairs.insert(pairs.end(), {a, b});
  }
  request.mutable_pairs()->Assign(pairs.begin(), pairs.end());
  request.mutable_wanted()->set_certificate(true);
  request.mutable_wanted()->set_separation(true);
  v1::BatchCheckCollisionsResponse all;
  const absl::Status status =
      MakeClient().BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
        Append(part, &all);
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  ASSERT_EQ(all.columns().pair_problems_size(), 0);
  ASSERT_EQ(all.piece_hulls_size(), 1);
  EXPECT_EQ(all.piece_hulls(0).hull_id(), "cube");
  // All but the pair of probes.
  EXPECT_EQ(ExpectProven(cell, pairs, HullsOf(all), PieceHullsOf(all), all.columns()), 9);
  EXPECT_TRUE(all.columns().certificates(0).pairs().empty());
  // No proofs if no certificate is wanted.
  request.mutable_wanted()->set_certificate(false);
  v1::BatchCheckCollisionsResponse plain;
  ASSERT_TRUE(MakeClient()
                  .BatchCheckCollisions(request,
                                        [&](const v1::BatchCheckCollisionsResponse& part) {
                                          plain.MergeFrom(part);
                                          return absl::OkStatus();
                                        })
                  .ok());
  EXPECT_EQ(plain.piece_hulls_size() + plain.columns().piece_proofs_size(), 0);
}

TEST_F(BodyProofs, ProofsOfScenesAreChecked) {
  const std::vector<v1::Placement> cell = Cell();
  v1::FindCollisionsRequest request;
  for (const v1::Placement& placement : cell) *request.add_placements() = placement;
  request.mutable_wanted()->set_certificate(true);
  request.mutable_wanted()->set_clearance(0.5);
  v1::FindCollisionsResponse all;
  const absl::Status status =
      MakeClient().FindCollisions(request, [&](const v1::FindCollisionsResponse& part) {
        Append(part, &all);
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  const std::vector<uint32_t> pairs(all.pairs().begin(), all.pairs().end());
  EXPECT_GE(ExpectProven(cell, pairs, HullsOf(all), PieceHullsOf(all), all.columns()), 3);
}

TEST_F(BodyProofs, ProofsOfStreamsAreCheckedAfterEachUpdate) {
  std::vector<v1::Placement> cell = Cell();
  v1::CollisionStreamOpen open;
  for (const v1::Placement& placement : cell) *open.add_placements() = placement;
  const std::vector<uint32_t> pairs = {0, 1, 0, 2, 0, 3, 3, 4};
  open.mutable_pairs()->Assign(pairs.begin(), pairs.end());
  open.mutable_wanted()->set_certificate(true);
  const auto stream = MakeClient().OpenCollisionStream();
  auto answer = stream->Open(open);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(ExpectProven(cell, pairs, HullsOf(*answer), PieceHullsOf(*answer), answer->columns()),
            3);
  // Another piece, which the stream sees when it refreshes.
  Put("other", Cube());
  ASSERT_TRUE(PutBody("row", {PlacementOf("other", 0.5, 0, 0), PlacementOf("cube", 9, 9, 9)}).ok());
  v1::CollisionStreamUpdate update;
  update.set_refresh_hulls(true);
  answer = stream->Update(update);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->piece_hulls_size(), 2);
  const std::vector<uint32_t> changed = {0, 1, 0, 2, 0, 3};
  EXPECT_EQ(ExpectProven(cell, changed, HullsOf(*answer), PieceHullsOf(*answer), answer->columns()),
            3);
  EXPECT_TRUE(stream->Close().ok());
}

TEST_F(BodyProofs, OnlyTheTooLargeRowFails) {
  Put("cube", Cube());
  ASSERT_TRUE(PutBody("heap", std::vector<v1::Placement>(100, PlacementOf("cube"))).ok());
  ASSERT_TRUE(PutBody("less", std::vector<v1::Placement>(80, PlacementOf("cube"))).ok());
  v1::BatchCheckCollisionsRequest request;
  *request.add_placements() = PlacementOf("heap");
  // 10000 pairs touch, too many for a proof; then 8000, whose proof is too large only if the six
  // vertex pairs of each are distinct.
  *request.add_placements() = PlacementOf("heap", 1, 0, 0);
  *request.add_placements() = PlacementOf("less", 1, 0, 0);
  *request.add_placements() = PlacementOf("cube", 1, 0, 0);
  *request.add_placements() = PlacementOf("less", 0.5, 0, 0);
  for (const uint32_t b : {1u, 2u, 3u, 4u}) {
    request.add_pairs(0);
    request.add_pairs(b);
  }
  request.mutable_wanted()->set_certificate(true);
  std::vector<v1::Relation> relations;
  std::vector<v1::ErrorReason> problems;
  size_t largest = 0;
  const absl::Status status =
      MakeClient().BatchCheckCollisions(request, [&](const v1::BatchCheckCollisionsResponse& part) {
        largest = std::max(largest, part.ByteSizeLong());
        for (const int relation : part.columns().relations()) {
          relations.push_back(static_cast<v1::Relation>(relation));
        }
        for (const v1::PairProblem& problem : part.columns().pair_problems()) {
          EXPECT_EQ(part.columns().relations(static_cast<int>(problem.row())),
                    v1::RELATION_UNSPECIFIED);
          EXPECT_THAT(problem.message(), HasSubstr("fewer pieces"));
          problems.push_back(problem.reason());
        }
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_LT(largest, size_t{4} << 20);
  ASSERT_EQ(relations.size(), 4u);
  EXPECT_EQ(relations[0], v1::RELATION_UNSPECIFIED);
  EXPECT_EQ(relations[2], v1::RELATION_TOUCHING);
  EXPECT_EQ(relations[3], v1::RELATION_OVERLAPPING);
  EXPECT_EQ(problems.front(), v1::ERROR_REASON_PROOF_TOO_LARGE);
}

}  // namespace body_certificates_test
}  // namespace hulld::server
