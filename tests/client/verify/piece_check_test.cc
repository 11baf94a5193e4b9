#include "client/verify/piece_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace hulld {
namespace piece_check_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;

v1::Pose At(double x, double y, double z) {
  v1::Pose pose;
  pose.mutable_translation()->set_x(x);
  pose.mutable_translation()->set_y(y);
  pose.mutable_translation()->set_z(z);
  return pose;
}

v1::Pose Turned(v1::Pose pose, double w, double x, double y, double z) {
  pose.mutable_rotation()->set_w(w);
  pose.mutable_rotation()->set_x(x);
  pose.mutable_rotation()->set_y(y);
  pose.mutable_rotation()->set_z(z);
  return pose;
}

// Vertex 4 x + 2 y + z is (x, y, z).
std::vector<double> Cube() {
  std::vector<double> xyz;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 2; axis >= 0; --axis) xyz.push_back((corner >> axis) & 1);
  }
  return xyz;
}

// A body that owns the data of its pieces.
struct Body {
  explicit Body(v1::Pose at = {}) : pose(std::move(at)) {}

  Body& Add(std::vector<double> xyz, v1::Pose in_body) {
    hulls.push_back(std::move(xyz));
    poses.push_back(std::move(in_body));
    return *this;
  }
  std::vector<PlacedVertices> pieces() const {
    std::vector<PlacedVertices> all;
    for (size_t i = 0; i < hulls.size(); ++i) {
      all.push_back({hulls[i], pose, &poses[i], false, {radius, piece_radius}});
    }
    return all;
  }

  v1::Pose pose;
  // Radii of the placement and of each piece.
  double radius = 0;
  double piece_radius = 0;
  std::deque<std::vector<double>> hulls;
  std::deque<v1::Pose> poses;
};

v1::PieceCertificate Proof(uint32_t a, uint32_t b, v1::Relation relation, double x, double y,
                           double z, const std::vector<std::pair<uint32_t, uint32_t>>& pairs = {}) {
  v1::PieceCertificate of;
  of.set_piece_a(a);
  of.set_piece_b(b);
  of.set_relation(relation);
  if (relation != kOverlapping) {
    v1::Vector3* const n = of.mutable_certificate()->mutable_direction();
    n->set_x(x);
    n->set_y(y);
    n->set_z(z);
  }
  for (const auto& [index_a, index_b] : pairs) {
    v1::VertexPair* const pair = of.mutable_certificate()->add_pairs();
    pair->set_index_a(index_a);
    pair->set_index_b(index_b);
  }
  return of;
}

// Returns the reason why the certificates do not prove the relation, or empty.
std::string Fault(v1::Relation relation, const std::vector<v1::PieceCertificate>& proofs,
                  const Body& a, const Body& b) {
  const PieceCertificates certificates(proofs.begin(), proofs.end());
  return std::string(
      CheckPieceCertificates(relation, certificates, a.pieces(), b.pieces()).message());
}

// Three cubes in a row along x, 2 apart, and two above them: piece 0 of B touches piece 1 of A;
// piece 1 of B, rotated, is separate from piece 2 of A but within its box.
class Touching : public testing::Test {
 protected:
  Touching() {
    a_.Add(Cube(), At(0, 0, 0)).Add(Cube(), At(2, 0, 0)).Add(Cube(), At(4, 0, 0));
    b_.Add(Cube(), At(2, 1, 0)).Add(Diamond(), At(0, 0, 0));
  }

  // Its axis-aligned box meets that of piece 2 of A; the piece itself does not.
  static std::vector<double> Diamond() { return {5.9, 0.5, 0, 4.9, 1.5, 0, 5.9, 1.5, 1}; }

  static v1::PieceCertificate Contact() { return Proof(1, 0, kTouching, 0, 1, 0, {{6, 4}}); }
  static v1::PieceCertificate Beside() { return Proof(2, 1, kSeparated, 1, 1, 0); }

  Body a_;
  Body b_;
};

TEST_F(Touching, IsProvenByTheContactAndByEveryPairThatBoxesDoNotSettle) {
  EXPECT_THAT(Fault(kTouching, {Contact(), Beside()}, a_, b_), IsEmpty());
  // In any order, and with superfluous ones.
  EXPECT_THAT(Fault(kTouching, {Beside(), Proof(0, 1, kSeparated, 1, 0, 0), Contact()}, a_, b_),
              IsEmpty());
}

TEST_F(Touching, AMissingPairIsNamed) {
  EXPECT_THAT(Fault(kTouching, {Contact()}, a_, b_),
              HasSubstr("pieces 2 of A and 1 of B have no certificate"));
  EXPECT_THAT(Fault(kSeparated, {Beside()}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B have no certificate"));
}

TEST_F(Touching, AWrongPieceIsNamed) {
  v1::PieceCertificate other = Beside();
  other.set_piece_b(0);
  EXPECT_THAT(Fault(kTouching, {Contact(), other}, a_, b_),
              HasSubstr("pieces 2 of A and 0 of B: the direction does not separate"));
  // Correct for that pair, but another pair lacks a certificate.
  EXPECT_THAT(Fault(kTouching, {Contact(), Proof(2, 0, kSeparated, -1, 0, 0)}, a_, b_),
              HasSubstr("pieces 2 of A and 1 of B have no certificate"));
  other.set_piece_b(2);
  EXPECT_THAT(Fault(kTouching, {Contact(), other}, a_, b_),
              HasSubstr("pieces 2 of A and 2 of B have a certificate, but A has 3 pieces and B 2"));
  other.set_piece_a(4'000'000'000);
  EXPECT_THAT(Fault(kTouching, {Contact(), other}, a_, b_), HasSubstr("pieces 4000000000 of A"));
  EXPECT_THAT(Fault(kTouching, {Contact(), Beside(), Beside()}, a_, b_),
              HasSubstr("pieces 2 of A and 1 of B have two certificates"));
}

TEST_F(Touching, ACertificateOfAnotherPairIsRefused) {
  v1::PieceCertificate other = Contact();
  *other.mutable_certificate() = Beside().certificate();
  EXPECT_THAT(Fault(kTouching, {other, Beside()}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B: the direction does not separate the interiors"));
  other = Beside();
  *other.mutable_certificate() = Contact().certificate();
  EXPECT_THAT(Fault(kTouching, {Contact(), other}, a_, b_),
              HasSubstr("pieces 2 of A and 1 of B: the direction does not separate"));
}

TEST_F(Touching, AMovedVertexIsNoticed) {
  b_.hulls[0][13] = std::nextafter(0.0, -1.0);  // y of vertex 4
  EXPECT_THAT(Fault(kTouching, {Contact(), Beside()}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B"));
  b_.hulls[0][13] = 0;
  EXPECT_THAT(Fault(kTouching, {Contact(), Beside()}, a_, b_), IsEmpty());
  // Moves a vertex out of its box, into the box of a pair decided by boxes.
  a_.hulls[0][12] = 2.5;
  EXPECT_THAT(Fault(kTouching, {Contact(), Beside()}, a_, b_),
              HasSubstr("pieces 0 of A and 0 of B have no certificate"));
  v1::PieceCertificate named = Contact();
  named.mutable_certificate()->mutable_pairs(0)->mutable_vertex_a()->set_x(7);
  EXPECT_THAT(Fault(kTouching, {named, Beside()}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B: pairs[0].a does not have the coordinates"));
}

TEST_F(Touching, AnotherRelationIsRefused) {
  EXPECT_THAT(Fault(kSeparated, {Contact(), Beside()}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B are RELATION_TOUCHING, so the bodies are not"));
  EXPECT_THAT(Fault(kOverlapping, {Contact(), Beside()}, a_, b_),
              HasSubstr("no certificate shows two pieces that are RELATION_OVERLAPPING"));
  EXPECT_THAT(Fault(v1::RELATION_WITHIN_TOLERANCE, {Contact()}, a_, b_),
              HasSubstr("has no certificate"));
  v1::PieceCertificate unknown = Contact();
  unknown.set_relation(v1::RELATION_UNSPECIFIED);
  EXPECT_THAT(Fault(kTouching, {unknown, Beside()}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B: RELATION_UNSPECIFIED has no certificate"));
  // Separated pieces do not touch.
  b_.pose = At(0, 0x1p-52, 0);
  EXPECT_THAT(Fault(kTouching, {Proof(1, 0, kSeparated, 0, 1, 0), Beside()}, a_, b_),
              HasSubstr("no certificate shows two pieces that are RELATION_TOUCHING"));
}

TEST_F(Touching, OneOverlapIsEnough) {
  b_.pose = At(0, -0.5, 0);
  const v1::PieceCertificate deep =
      Proof(1, 0, kOverlapping, 0, 0, 0, {{0, 7}, {7, 0}, {2, 5}, {6, 1}, {3, 4}, {5, 2}});
  const std::string alone = Fault(kOverlapping, {deep}, a_, b_);
  EXPECT_THAT(alone, IsEmpty());
  EXPECT_THAT(Fault(kTouching, {deep}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B are RELATION_OVERLAPPING"));
  EXPECT_THAT(Fault(kOverlapping, {}, a_, b_), HasSubstr("no certificate shows"));
  b_.pose = At(0, 0, 0);
  EXPECT_THAT(Fault(kOverlapping, {deep}, a_, b_),
              HasSubstr("pieces 1 of A and 0 of B: 0 is not inside"));
}

// Boxes decide exactly, to the last bit: a third of a turn about the diagonal of the body, then of
// the piece, at scales that no double represents.
TEST(PieceCheck, BoxesAreExact) {
  for (const double scale : {1.0, 0x1p-1060, 0x1p1000}) {
    const auto point = [scale](double x) { return std::vector<double>{x * scale, 0, 0}; };
    // (x, 0, 0) is rotated to (0, x, 0), and then to (0, 0, x).
    Body a(Turned(At(0, 0, 0), 3, 3, 3, 3));
    a.Add(point(5), Turned(At(0, 0, 0), 1, 1, 1, 1));
    for (const double z : {4.0, 5.0, 6.0}) {
      Body b;
      b.Add({0, 0, 0}, At(0, 0, z * scale));
      EXPECT_EQ(Fault(kSeparated, {}, a, b).empty(), z != 5) << scale << " " << z;
    }
  }
  // By 3/5 and 4/5, which doubles cannot represent: the products of the poses are exact, and so is
  // the contact.
  Body a(Turned(At(1, 0, 0), 2, 1, 0, 0));
  a.Add({0, 0, 5}, Turned(At(0, 0, 0), 2, -1, 0, 0));
  for (const double z : {std::nextafter(5.0, 0.0), 5.0, std::nextafter(5.0, 6.0)}) {
    Body b;
    b.Add({0, 0, z}, At(1, 0, 0));
    EXPECT_EQ(Fault(kSeparated, {}, a, b).empty(), z != 5);
  }
  a.poses[0] = At(0, 0, 0);
  Body third;
  // (0, -4, 3), and R(2, 1, 0, 0) (0, 0, 1) = (0, -4/5, 3/5).
  third.Add({0, -4, 3}, At(1, 0, 0));
  EXPECT_THAT(Fault(kSeparated, {}, a, third), HasSubstr("boxes along the axes meet"));
  a.hulls[0] = {0, 0, 1};
  third.hulls[0] = {0, -0.8, 0.6};
  EXPECT_THAT(Fault(kSeparated, {}, a, third), IsEmpty());
}

TEST(PieceCheck, HullsAreOnePieceEach) {
  Body b;
  b.Add(Cube(), At(3, 0, 0)).Add(Cube(), At(0.5, 2, 0));
  const std::vector<double> cube = Cube();
  const v1::Pose pose = At(2, 0, 0);
  const PlacedVertices hull[] = {{cube, pose}};
  PieceCertificates proofs;
  *proofs.Add() = Proof(0, 0, kTouching, 1, 0, 0, {{4, 0}});
  EXPECT_TRUE(CheckPieceCertificates(kTouching, proofs, hull, b.pieces()).ok());
  proofs[0].set_piece_a(1);
  EXPECT_THAT(std::string(CheckPieceCertificates(kTouching, proofs, hull, b.pieces()).message()),
              HasSubstr("A has 1 pieces"));
}

TEST(PieceCheck, RadiiGrowTheBoxes) {
  Body a, b;
  a.Add(Cube(), At(0, 0, 0));
  b.Add(Cube(), At(2, 0, 0));
  EXPECT_THAT(Fault(kSeparated, {}, a, b), IsEmpty());
  a.radius = 0.25;
  a.piece_radius = 0.25;
  b.radius = std::nextafter(0.5, 0);
  EXPECT_THAT(Fault(kSeparated, {}, a, b), IsEmpty());
  b.radius = 0.5;
  EXPECT_THAT(Fault(kSeparated, {}, a, b), HasSubstr("pieces 0 of A and 0 of B have no"));
  EXPECT_THAT(Fault(kTouching, {Proof(0, 0, kTouching, 1, 0, 0, {{4, 0}})}, a, b), IsEmpty());
  b.piece_radius = 0x1p-60;
  EXPECT_THAT(Fault(kTouching, {Proof(0, 0, kTouching, 1, 0, 0, {{4, 0}})}, a, b),
              HasSubstr("too small for their radii"));
  EXPECT_THAT(Fault(kOverlapping, {Proof(0, 0, kOverlapping, 0, 0, 0, {{4, 0}})}, a, b), IsEmpty());
}

TEST(PieceCheck, EmptyPiecesAreSettled) {
  Body a, b;
  a.Add({}, At(0, 0, 0));
  b.Add(Cube(), At(0, 0, 0)).Add({}, At(0, 0, 0));
  EXPECT_THAT(Fault(kSeparated, {}, a, b), IsEmpty());
  EXPECT_THAT(Fault(kSeparated, {Proof(0, 0, kSeparated, 0, 0, 0)}, a, b), IsEmpty());
  EXPECT_THAT(Fault(kTouching, {Proof(0, 1, kTouching, 1, 0, 0)}, a, b),
              HasSubstr("pieces 0 of A and 1 of B: a hull is empty"));
  EXPECT_THAT(Fault(kSeparated, {}, Body(), b), IsEmpty());
}

TEST(PieceCheck, PosesMustBeFinite) {
  Body a, b;
  a.Add(Cube(), At(0, 0, 0)).Add(Cube(), At(NAN, 0, 0));
  b.Add(Cube(), At(0, 9, 0));
  EXPECT_THAT(Fault(kSeparated, {}, a, b), HasSubstr("piece 1 of A: a translation contains"));
  b.poses[0] = Turned(At(0, 9, 0), 0, 0, 0, 0);
  a.poses[1] = At(0, 0, 0);
  EXPECT_THAT(Fault(kSeparated, {}, a, b), HasSubstr("piece 0 of B: a rotation is zero"));
}

}  // namespace piece_check_test
}  // namespace hulld
