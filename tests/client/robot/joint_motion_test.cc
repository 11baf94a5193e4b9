// Bounds of the motion between two configurations, against kinematics in long double that share no
// code with the library.
#include "client/robot/joint_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "client/robot/urdf_file.h"
#include "tests/client/robot/urdf_text.h"

namespace hulld {
namespace joint_motion_test {

using Real = long double;
using Vector = std::array<Real, 3>;

// p -> R p + x.
struct Motion {
  std::array<Vector, 3> R = {Vector{1, 0, 0}, Vector{0, 1, 0}, Vector{0, 0, 1}};
  Vector x = {0, 0, 0};

  Vector Apply(const Vector& p) const {
    Vector moved = x;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 3; ++j) moved[i] += R[i][j] * p[j];
    }
    return moved;
  }
};

Motion operator*(const Motion& a, const Motion& b) {
  Motion product;
  product.x = a.Apply(b.x);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      product.R[i][j] = 0;
      for (size_t k = 0; k < 3; ++k) product.R[i][j] += a.R[i][k] * b.R[k][j];
    }
  }
  return product;
}

Motion OfQuaternion(Real w, Real x, Real y, Real z, const Vector& translation) {
  const Real s = 2 / (w * w + x * x + y * y + z * z);
  Motion motion;
  motion.R = {Vector{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
              Vector{s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
              Vector{s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}};
  motion.x = translation;
  return motion;
}

Motion OfPose(const RigidPose& X) {
  return OfQuaternion(X[0], X[1], X[2], X[3], {X[4], X[5], X[6]});
}

Motion AboutAxis(const std::array<double, 3>& axis, Real angle) {
  const Real length =
      std::sqrt(Real{axis[0]} * axis[0] + Real{axis[1]} * axis[1] + Real{axis[2]} * axis[2]);
  const Real s = std::sin(angle / 2) / length;
  return OfQuaternion(std::cos(angle / 2), s * axis[0], s * axis[1], s * axis[2], {0, 0, 0});
}

Motion OfJoint(const RobotJoint& joint, const JointValue& from, const JointValue& to, Real t) {
  std::array<Real, 7> value;
  for (size_t i = 0; i < 7; ++i) value[i] = (1 - t) * from[i] + t * to[i];
  switch (joint.kind) {
    case JointKind::kRevolute:
    case JointKind::kContinuous:
      return AboutAxis(joint.axis, value[0]);
    case JointKind::kPrismatic: {
      Motion motion;
      for (size_t i = 0; i < 3; ++i) motion.x[i] = value[0] * joint.axis[i];
      return motion;
    }
    case JointKind::kPlanar: {
      // The tests have planes with the normal z.
      Motion motion = AboutAxis(joint.axis, value[2]);
      motion.x = {value[0], value[1], 0};
      return motion;
    }
    case JointKind::kFloating:
      return OfQuaternion(value[0], value[1], value[2], value[3], {value[4], value[5], value[6]});
    case JointKind::kFixed:
      break;
  }
  return {};
}

std::vector<Motion> ExactMotions(const Robot& robot, const RigidPose& X_WB,
                                 const std::vector<JointValue>& from,
                                 const std::vector<JointValue>& to, Real t) {
  std::vector<Motion> links(robot.links.size(), OfPose(X_WB));
  for (size_t i = 1; i < links.size(); ++i) {
    const auto j = static_cast<size_t>(robot.links[i].parent_joint);
    const RobotJoint& joint = robot.joints[j];
    links[i] = links[static_cast<size_t>(joint.parent)] * OfPose(joint.X_PJ) *
               OfJoint(joint, from[j], to[j], t);
  }
  return links;
}

// The motion of Placement.end_pose between normalized poses.
Motion Between(RigidPose X, RigidPose Y, Real t) {
  for (RigidPose* pose : {&X, &Y}) {
    const double length = std::sqrt((*pose)[0] * (*pose)[0] + (*pose)[1] * (*pose)[1] +
                                    (*pose)[2] * (*pose)[2] + (*pose)[3] * (*pose)[3]);
    for (size_t i = 0; i < 4; ++i) (*pose)[i] /= length;
  }
  std::array<Real, 7> at;
  for (size_t i = 0; i < 7; ++i) at[i] = (1 - t) * X[i] + t * Y[i];
  return OfQuaternion(at[0], at[1], at[2], at[3], {at[4], at[5], at[6]});
}

Real Distance(const Vector& p, const Vector& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

// A cart with a floating crate, an arm on the cart, and a base that is far away.
constexpr char kLooseArm[] = R"(<robot name="loose">
  <link name="world"/><link name="cart"/><link name="crate"/><link name="arm"/><link name="hand"/>
  <joint name="wheels" type="planar"><parent link="world"/><child link="cart"/><axis xyz="0 0 1"/></joint>
  <joint name="free" type="floating"><parent link="cart"/><child link="crate"/><origin xyz="0 3 1" rpy="1 2 3"/></joint>
  <joint name="i" type="continuous"><parent link="crate"/><child link="arm"/><origin xyz="1 0 0" rpy="0.5 0 0"/><axis xyz="1 2 2"/></joint>
  <joint name="j" type="prismatic"><parent link="arm"/><child link="hand"/><origin xyz="0 2 0"/><axis xyz="0 3 4"/><limit lower="-9" upper="9"/></joint>
</robot>)";

class JointMotion : public testing::TestWithParam<const char*> {
 protected:
  JointMotion() : robot_(*ParseUrdf(GetParam(), "test.urdf")) {}

  std::vector<JointValue> RandomValues() {
    std::uniform_real_distribution<double> any(-2, 2);
    std::vector<double> values(robot_.Variables().size());
    for (double& value : values) value = any(random_);
    return AllJointValues(robot_, values);
  }

  const Robot robot_;
  std::mt19937_64 random_{1};
};

TEST_P(JointMotion, PointsStayWithinTheirDeviationAndTravel) {
  const RigidPose X_WB = {2, 1, 0, -1, 100, 0, 7};
  const Vector p = {0.3, -0.4, 1.2};
  constexpr double kReach = 1.3;
  Real largest_ratio = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<JointValue> from = RandomValues();
    std::vector<JointValue> to = RandomValues();
    AlignTurns(robot_, from, to);
    const std::vector<MotionBound> bounds = BoundMotions(robot_, X_WB, from, to);
    for (const double duration : {0.125, 0x1p-6, 0x1p-12, 0x1p-20, 0x1p-40}) {
      const double begin = 0.625;
      const auto X = LinkPoses(robot_, X_WB, JointValuesAt(from, to, begin));
      const auto Y = LinkPoses(robot_, X_WB, JointValuesAt(from, to, begin + duration));
      const auto start = ExactMotions(robot_, X_WB, from, to, begin);
      for (const double t : {0.0, 0.25, 0.5, 1.0}) {
        const auto exact = ExactMotions(robot_, X_WB, from, to, begin + Real{t} * duration);
        for (size_t i = 0; i < exact.size(); ++i) {
          if (duration * bounds[i].turn > MotionBound::kMaxTurn) continue;
          const Vector q = exact[i].Apply(p);
          const Real deviation = Distance(q, Between(X[i], Y[i], t).Apply(p));
          const double bound = bounds[i].Deviation(duration, kReach);
          EXPECT_LE(deviation, bound) << robot_.links[i].name << " " << duration << " " << t;
          EXPECT_LE(Distance(q, start[i].Apply(p)), bounds[i].Travel(duration, kReach) + 1e-15L);
          if (duration == 0x1p-6) largest_ratio = std::max(largest_ratio, deviation / bound);
        }
      }
    }
  }
  // The bound is tight enough to matter.
  EXPECT_GT(largest_ratio, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Robots, JointMotion, testing::Values(kArmUrdf, kLooseArm));

TEST(JointMotionOfASlide, OnlyRounds) {
  const Robot robot = *ParseUrdf(
      "<robot name='s'><link name='a'/><link name='b'/><joint name='j' type='prismatic'><parent "
      "link='a'/><child link='b'/><axis xyz='1 0 0'/><limit lower='0' upper='1'/></joint></robot>",
      "slide.urdf");
  const auto from = AllJointValues(robot, std::vector<double>{0});
  const auto to = AllJointValues(robot, std::vector<double>{1});
  const std::vector<MotionBound> bounds = BoundMotions(robot, kNoMotion, from, to);
  EXPECT_EQ(bounds[1].speed, 1);
  EXPECT_EQ(bounds[1].bend, 0);
  EXPECT_LT(bounds[1].Deviation(1, 1), 3e-14);
  EXPECT_GT(bounds[1].Deviation(1, 1), 0);
}

TEST(JointMotionOfAFloatingJoint, TurnsTheShorterWay) {
  const Robot robot = *ParseUrdf(
      "<robot name='f'><link name='a'/><link name='b'/><joint name='j' type='floating'><parent "
      "link='a'/><child link='b'/></joint></robot>",
      "floating.urdf");
  const std::vector<JointValue> from = {{1, 0, 0, 0, 1, 2, 3}};
  std::vector<JointValue> to = {{-2, 0.5, 0, 0, 4, 5, 6}};
  AlignTurns(robot, from, to);
  EXPECT_EQ(to[0], (JointValue{2, -0.5, 0, 0, 4, 5, 6}));
  AlignTurns(robot, from, to);
  EXPECT_EQ(to[0], (JointValue{2, -0.5, 0, 0, 4, 5, 6}));
}

}  // namespace joint_motion_test
}  // namespace hulld
