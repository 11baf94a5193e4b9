#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/checks/relation_check.h"
#include "tests/test_size.h"

namespace hulld {
namespace contact_matrix_test {

constexpr int kStride = TestSize(1, 23);
constexpr int kFlatRounds = TestSize(2400, 600);

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Quaternion = std::array<double, 4>;

// Contacts in the plane x = 0 that contain the origin: a point, or edges or faces with the origin
// inside, at an end, on an edge, or at a corner.
std::vector<std::vector<Vector>> Contacts() {
  return {
      {{0, 0, 0}},
      {{0, -1, 0}, {0, 1, 0}},
      {{0, 0, 0}, {0, 2, 0}},
      {{0, -1, -1}, {0, 1, 1}},
      {{0, 0, -1}, {0, 0, 1}},
      {{0, -1, -1}, {0, 1, -1}, {0, 1, 1}, {0, -1, 1}},
      {{0, 0, 0}, {0, 2, 0}, {0, 2, 2}, {0, 0, 2}},
      {{0, 0, -1}, {0, 2, -1}, {0, 2, 1}, {0, 0, 1}},
      {{0, -1, -1}, {0, 2, -1}, {0, -1, 2}},
  };
}

// Each contact alone, with an apex behind it, and as the face of a prism: all in x <= 0, of every
// dimension.
std::vector<std::vector<Vector>> ShapesBehindThePlane() {
  std::vector<std::vector<Vector>> shapes;
  for (const std::vector<Vector>& contact : Contacts()) {
    shapes.push_back(contact);
    shapes.push_back(Concatenated(contact, {{-2, 0, 0}}));
    shapes.push_back(Concatenated(contact, {{-1, 3, 1}}));
    shapes.push_back(Concatenated(contact, Shifted(contact, Vector(-2, 0, 0))));
    shapes.push_back(Concatenated(contact, Shifted(contact, Vector(-1, 1, -2))));
  }
  return shapes;
}

std::vector<Vector> Mirrored(std::vector<Vector> points) {
  for (Vector& p : points) p.x() = -p.x();
  return points;
}

// R(q)^T p / |q|^2, exact for integers if |q|^2 divides p.
Vector RotatedBack(const Quaternion& q, const Vector& p) {
  const auto [w, x, y, z] = q;
  const double norm = w * w + x * x + y * y + z * z;
  Eigen::Matrix3d r;
  r << w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
      w * w - x * x + y * y - z * z, 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
      w * w - x * x - y * y + z * z;
  const Vector rotated = r.transpose() * p;
  return rotated / norm;
}

// Integer quaternions with squared norms that divide kUnit, including quarter and third turns,
// which map integers to integers.
constexpr double kUnit = 315;
constexpr Quaternion kRotations[] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 0, 1, 0},  {1, 0, 0, -1},
                                     {0, 1, 0, 0}, {1, 1, 1, 1}, {1, -1, 1, 1}, {2, 1, 0, 0},
                                     {0, 2, 1, 0}, {3, 1, 2, 1}, {1, 2, 2, 0},  {0, 1, 2, 2},
                                     {2, 1, 1, 1}, {4, 2, 1, 0}, {2, 0, 0, -1}};

// A pair of hulls in contact across the plane x = 0 of a frame.
struct Contact {
  Hull a;
  Hull b;
  Pose X_WA;
  Pose X_WB;
};

// Moves B by the smallest step of a coordinate of its translation, toward +direction.
void Nudge(Contact& contact, int coordinate, int direction) {
  double& t = contact.X_WB.t[coordinate];
  t = std::nextafter(t, direction * kInfinity);
}

// Gives each hull its own integer quaternion, so that the contact lies on x = const of the world.
// All numbers are integers times one power of two, so the contact is exact.
Contact IntegerContact(Random& random, const std::vector<Vector>& a, const std::vector<Vector>& b) {
  const double scale = std::ldexp(1.0, std::array{-498, -20, 0, 20, 498}[random.Below(5)]);
  const Vector offset = random.Below(2) ? Vector(1e6, -3, 70000) : Vector(0, 0, 0);
  const auto place = [&](const std::vector<Vector>& shape, Pose* pose) {
    const Quaternion q = kRotations[random.Below(std::size(kRotations))];
    // The hull's own frame may be far away as well.
    const Vector center = random.Below(3) == 0 ? Vector(315e4, -630, 945) : Vector(0, 0, 0);
    std::vector<Vector> local;
    for (const Vector& p : shape) local.push_back(RotatedBack(q, kUnit * p - center) * scale);
    // Any multiple of q is the same rotation.
    const double factor = std::array{1.0, -2.0, 3.0, 0x1p-300, 0x1p400}[random.Below(5)];
    for (int i = 0; i < 4; ++i) pose->q[i] = q[i] * factor;
    pose->t = (offset + center) * scale;
    return BuildHull(local);
  };
  Contact contact;
  contact.a = place(a, &contact.X_WA);
  contact.b = place(b, &contact.X_WB);
  return contact;
}

// Gives both hulls the same pose of arbitrary doubles, at a decimal scale: the contact is exact in
// their common frame.
Contact CommonPoseContact(Random& random, const std::vector<Vector>& a,
                          const std::vector<Vector>& b) {
  const double scale = std::array{1e-150, 1e-6, 1.0, 1e6, 1e150}[random.Below(5)];
  Contact contact;
  for (double& q : contact.X_WA.q) q = random.Real(-1, 1);
  contact.X_WA.t = Vector(random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)) * scale;
  if (random.Below(2)) contact.X_WA.t += Vector(1e6, 1e6, -1e6);
  contact.X_WB = contact.X_WA;
  contact.a = BuildHull(Scaled(a, scale));
  contact.b = BuildHull(Scaled(b, scale));
  return contact;
}

// Returns the world direction of the frame's x axis; the sign of each coordinate is correct unless
// close to zero.
Vector NormalOf(const Pose& pose) {
  const auto [w, x, y, z] = pose.q;
  return Vector(w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y));
}

TEST(ContactMatrix, IntegerPosesTouchExactlyAndOneStepDecides) {
  const uint64_t seed = TestSeed(401);
  Random random(seed);
  RelationCheck check;
  const std::vector<std::vector<Vector>> shapes = ShapesBehindThePlane();
  for (size_t i = 0; i < shapes.size() * shapes.size(); i += kStride) {
    const std::vector<Vector>& a = shapes[i / shapes.size()];
    const std::vector<Vector> b = Mirrored(shapes[i % shapes.size()]);
    const Contact contact = IntegerContact(random, a, b);
    ASSERT_TRUE(check.Verify(contact.a, contact.X_WA, contact.b, contact.X_WB, Relation::kTouching))
        << "seed " << seed << " pair " << i;
    Contact gap = contact;
    Nudge(gap, 0, +1);
    ASSERT_TRUE(check.Verify(gap.a, gap.X_WA, gap.b, gap.X_WB, Relation::kSeparated))
        << "seed " << seed << " pair " << i;
    Contact overlap = contact;
    Nudge(overlap, 0, -1);
    const Relation expected = OracleRelation(overlap.a, overlap.X_WA, overlap.b, overlap.X_WB);
    ASSERT_TRUE(check.Verify(overlap.a, overlap.X_WA, overlap.b, overlap.X_WB, expected))
        << "seed " << seed << " pair " << i;
    // A step along the contact: the oracle decides.
    Contact slide = contact;
    Nudge(slide, 1 + random.Below(2), random.Below(2) ? 1 : -1);
    ASSERT_TRUE(check.Verify(slide.a, slide.X_WA, slide.b, slide.X_WB,
                             OracleRelation(slide.a, slide.X_WA, slide.b, slide.X_WB)))
        << "seed " << seed << " pair " << i;
  }
  EXPECT_GT(check.count(Relation::kTouching), check.queries() / 3);
  EXPECT_GT(check.count(Relation::kSeparated), check.queries() / 4);
  EXPECT_GT(check.count(Relation::kOverlapping), check.queries() / 20);
  EXPECT_GT(check.count(Rung::kExact), check.queries() / 3);
}

TEST(ContactMatrix, CommonPosesTouchExactlyAndOneStepDecides) {
  const uint64_t seed = TestSeed(402);
  Random random(seed);
  RelationCheck check;
  const std::vector<std::vector<Vector>> shapes = ShapesBehindThePlane();
  for (size_t i = 0; i < shapes.size() * shapes.size(); i += kStride) {
    const std::vector<Vector>& a = shapes[i / shapes.size()];
    const std::vector<Vector> b = Mirrored(shapes[i % shapes.size()]);
    const Contact contact = CommonPoseContact(random, a, b);
    ASSERT_TRUE(check.Verify(contact.a, contact.X_WA, contact.b, contact.X_WB, Relation::kTouching))
        << "seed " << seed << " pair " << i;
    const Vector normal = NormalOf(contact.X_WA);
    int k = 0;
    normal.cwiseAbs().maxCoeff(&k);
    const int outward = normal[k] > 0 ? 1 : -1;
    Contact gap = contact;
    Nudge(gap, k, outward);
    ASSERT_TRUE(check.Verify(gap.a, gap.X_WA, gap.b, gap.X_WB, Relation::kSeparated))
        << "seed " << seed << " pair " << i;
    Contact overlap = contact;
    Nudge(overlap, k, -outward);
    const Relation expected = OracleRelation(overlap.a, overlap.X_WA, overlap.b, overlap.X_WB);
    ASSERT_TRUE(check.Verify(overlap.a, overlap.X_WA, overlap.b, overlap.X_WB, expected))
        << "seed " << seed << " pair " << i;
  }
  EXPECT_GE(check.count(Relation::kTouching), check.queries() / 3);
  EXPECT_GE(check.count(Relation::kSeparated), check.queries() / 3);
  EXPECT_GT(check.count(Relation::kOverlapping), check.queries() / 20);
}

// Rounded coordinates: offset and scale inside the hulls themselves, unrotated and at quarter
// turns, with one coordinate of B's contact moved by one unit in the last place. The oracle
// provides the expected answers.
TEST(ContactMatrix, RoundedCoordinatesAreAnsweredExactly) {
  const uint64_t seed = TestSeed(403);
  Random random(seed);
  RelationCheck check;
  const std::vector<std::vector<Vector>> shapes = ShapesBehindThePlane();
  for (size_t i = 0; i < shapes.size() * shapes.size(); i += kStride) {
    const double scale = std::array{1e-6, 0.1, 1.0, 1e6}[random.Below(4)];
    const double offset = random.Below(2) ? 1e6 : 0;
    const auto rounded = [&](std::vector<Vector> points) {
      return Shifted(Scaled(std::move(points), scale), Vector::Constant(offset));
    };
    std::vector<Vector> b = rounded(Mirrored(shapes[i % shapes.size()]));
    const int nudge = random.Between(-1, 1);
    for (Vector& p : b) {
      if (nudge != 0 && p.x() == offset) p.x() = std::nextafter(p.x(), nudge * kInfinity);
    }
    const Hull hull_a = BuildHull(rounded(shapes[i / shapes.size()]));
    const Hull hull_b = BuildHull(b);
    Pose pose;
    pose.q = kRotations[random.Below(7)];
    const Relation expected = OracleRelation(hull_a, pose, hull_b, pose);
    ASSERT_TRUE(check.Verify(hull_a, pose, hull_b, pose, expected))
        << "seed " << seed << " pair " << i;
  }
  EXPECT_GT(check.count(Relation::kTouching), check.queries() / 10);
  EXPECT_GT(check.count(Relation::kSeparated), check.queries() / 10);
  EXPECT_GT(check.count(Relation::kOverlapping), check.queries() / 20);
}

// Needles and polygons that pierce each other deeply or minimally.
TEST(ContactMatrix, PiercingIsOverlapping) {
  const std::vector<Vector> square_points = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  const std::vector<Vector> needle_points = {{0, 0, -1}, {0, 0, 1}};
  const Hull square = BuildHull(square_points);
  const Hull needle = BuildHull(needle_points);
  const auto at = [](double x, double y, double z) {
    Pose pose;
    pose.t = Vector(x, y, z);
    return pose;
  };
  const double below_one = std::nextafter(1.0, 0.0);
  const double above_one = std::nextafter(1.0, 2.0);
  RelationCheck check;
  const auto expect = [&](const Pose& pose, Relation expected) {
    EXPECT_TRUE(check.Verify(square, Pose(), needle, pose, expected));
  };
  expect(at(0, 0, 0), Relation::kOverlapping);
  expect(at(below_one, 0, 0), Relation::kOverlapping);
  expect(at(0, 0, below_one), Relation::kOverlapping);
  expect(at(below_one, -below_one, -below_one), Relation::kOverlapping);
  expect(at(1, 0, 0), Relation::kTouching);
  expect(at(1, 1, 0), Relation::kTouching);
  expect(at(0, 0, 1), Relation::kTouching);
  expect(at(1, 1, -1), Relation::kTouching);
  expect(at(above_one, 0, 0), Relation::kSeparated);
  expect(at(0, 0, above_one), Relation::kSeparated);
  // Two squares that cross, share a line, or share an area.
  Pose upright;
  upright.q = {1, 1, 0, 0};
  EXPECT_TRUE(check.Verify(square, Pose(), square, upright, Relation::kOverlapping));
  upright.t = Vector(0, 0, 1);
  EXPECT_TRUE(check.Verify(square, Pose(), square, upright, Relation::kTouching));
  upright.t = Vector(0, 0, above_one);
  EXPECT_TRUE(check.Verify(square, Pose(), square, upright, Relation::kSeparated));
  EXPECT_TRUE(check.Verify(square, Pose(), square, at(1, 0.5, 0), Relation::kTouching));
  EXPECT_TRUE(check.Verify(square, Pose(), square, at(0, 0, 5e-324), Relation::kSeparated));
}

// Points, collinear segments, and coplanar polygons against each other: flat differences of every
// dimension, in tilted frames.
TEST(ContactMatrix, FlatPairsInOnePlaneTouchOrSeparate) {
  const uint64_t seed = TestSeed(404);
  Random random(seed);
  RelationCheck check;
  for (int i = 0; i < kFlatRounds; ++i) {
    const int dimension = random.Below(3);
    const auto vector = [&] {
      return Vector(random.Between(-3, 3), random.Between(-3, 3), random.Between(-3, 3));
    };
    const Vector u = vector(), v = vector(), origin = vector();
    const auto set = [&] {
      std::vector<Vector> points;
      for (int n = random.Between(1, 5); n > 0; --n) {
        points.push_back(origin + u * (dimension > 0 ? random.Between(-3, 3) : 0) +
                         v * (dimension > 1 ? random.Between(-3, 3) : 0));
      }
      return BuildHull(points);
    };
    const Hull a = set();
    const Hull b = set();
    Pose pose;
    for (double& q : pose.q) q = random.Real(-1, 1);
    pose.t = Vector(random.Real(-9, 9), random.Real(-9, 9), 1e6);
    const Relation expected = OracleRelation(a, pose, b, pose);
    ASSERT_NE(expected, Relation::kOverlapping);
    ASSERT_TRUE(check.Verify(a, pose, b, pose, expected)) << "seed " << seed << " round " << i;
  }
  EXPECT_GT(check.count(Relation::kTouching), check.queries() / 8);
  EXPECT_GT(check.count(Relation::kSeparated), check.queries() / 8);
}

}  // namespace contact_matrix_test
}  // namespace hulld
