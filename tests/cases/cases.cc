#include "tests/cases/cases.h"

#include <cmath>
#include <limits>
#include <random>
#include <utility>

namespace hulld {
namespace {

using Points = std::vector<double>;
using Vec = std::array<double, 3>;

constexpr v1::Relation kSeparated = v1::RELATION_SEPARATED;
constexpr v1::Relation kTouching = v1::RELATION_TOUCHING;
constexpr v1::Relation kOverlapping = v1::RELATION_OVERLAPPING;
constexpr double kNoClosedForm = std::numeric_limits<double>::quiet_NaN();

// A rotation of both that is not representable as a matrix of doubles.
constexpr std::array<double, 4> kTurned = {7, 1, 2, 3};

// 2^-n.
double Bit(int n) { return std::ldexp(1.0, -n); }

Points Cuboid(const Vec& low, const Vec& high) {
  Points points;
  for (int corner = 0; corner < 8; ++corner) {
    for (size_t axis = 0; axis < 3; ++axis) {
      points.push_back(((corner >> axis) & 1) != 0 ? high[axis] : low[axis]);
    }
  }
  return points;
}

Points Octahedron(const Vec& center, double radius) {
  Points points;
  for (size_t axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec point = center;
      point[axis] += sign * radius;
      points.insert(points.end(), point.begin(), point.end());
    }
  }
  return points;
}

// An octagonal prism along z, with rational corners.
Points Prism(double x, double y, double low, double high) {
  constexpr double kCorners[][2] = {{2, 1},   {1, 2},   {-1, 2}, {-2, 1},
                                    {-2, -1}, {-1, -2}, {1, -2}, {2, -1}};
  Points points;
  for (const double z : {low, high}) {
    for (const auto& corner : kCorners)
      points.insert(points.end(), {x + corner[0], y + corner[1], z});
  }
  return points;
}

// Irregular hulls in x <= 0 and x >= gap, nearest at (0, 0, 0) and (gap, 0, 0).
std::pair<Points, Points> FacingHulls(double gap) {
  std::mt19937 random(3383);
  std::uniform_int_distribution<int> steps(-64, 64);
  std::pair<Points, Points> hulls = {{0, 0, 0}, {gap, 0, 0}};
  for (int i = 0; i < 40; ++i) {
    const double depth = (70 + steps(random)) / 64.0;
    const double y = steps(random) / 64.0;
    const double z = steps(random) / 64.0;
    hulls.first.insert(hulls.first.end(), {-depth, y, z});
    hulls.second.insert(hulls.second.end(), {gap + depth, z, y});
  }
  return hulls;
}

Points Repeated(const Points& points, int times) {
  Points all;
  for (int i = 0; i < times; ++i) all.insert(all.end(), points.begin(), points.end());
  return all;
}

void AddBoxes(std::vector<Case>* cases) {
  const Points cube = Cuboid({0, 0, 0}, {1, 1, 1});
  const Points plate = Cuboid({-64, -64, -0.5}, {64, 64, 0});
  cases->push_back({"google-deepmind/mujoco#3476", cube,
                    Cuboid({0.25, 0.125, 1 - Bit(14)}, {1.25, 1.125, 2 - Bit(14)}), kOverlapping,
                    -Bit(14)});
  cases->push_back(
      {"google-deepmind/mujoco_warp#1526", Cuboid({-0.25, -0.25, 0}, {0.25, 0.25, 0.5}),
       Cuboid({-0.125, -0.125, 0.5 - Bit(12)}, {0.125, 0.125, 0.75}), kOverlapping, -Bit(12)});
  cases->push_back({"google-deepmind/mujoco_warp#1430", plate,
                    Cuboid({20, -8, -Bit(13)}, {20.25, -7.75, 0.25}), kOverlapping, -Bit(13)});
  cases->push_back({"newton-physics/newton#3248", Cuboid({-16, -12, -0.25}, {16, 12, 0.25}),
                    Cuboid({15.5, 11.5, 0.25 - Bit(8)}, {15.75, 11.75, 0.5}), kOverlapping,
                    -Bit(8)});
  cases->push_back({"danfis/libccd#25", Cuboid({-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}),
                    Cuboid({-1.5, -1.5, 1.375}, {1.5, 1.5, 4.375}), kOverlapping, -0.125});
  cases->push_back(
      {"flexible-collision-library/fcl#508", cube, Cuboid({0, 0, 5}, {1, 1, 6}), kSeparated, 4});
  cases->push_back({"flexible-collision-library/fcl#545", Cuboid({-1, -1, -1}, {1, 1, 1}),
                    Cuboid({0.75, 0.75, 0.75}, {1, 1, 1}), kOverlapping, -0.25});
  cases->push_back({"flexible-collision-library/fcl#493", cube,
                    Cuboid({1 + Bit(52), 0, 0}, {2, 1, 1}), kSeparated, Bit(52), 0, kTurned});
  cases->push_back({"flexible-collision-library/fcl#495", cube, Cuboid({1, 0.25, 0.5}, {2, 1, 1}),
                    kTouching, 0, 0, kTurned});
  cases->push_back({"flexible-collision-library/fcl#395",
                    Cuboid({-0.5, -0.5, -Bit(8)}, {0.5, 0.5, Bit(8)}),
                    Octahedron({0, 0, 0.25}, 0.25), kOverlapping, -Bit(8)});
  cases->push_back({"MattiaMontanari/openGJK#13", cube,
                    Cuboid({0.25, 0.125, 0.0625}, {1.25, 1.125, 1.0625}), kOverlapping, -0.75, 0,
                    kTurned});
  cases->push_back({"bulletphysics/bullet3#1703", Cuboid({-128, -0.5, -128}, {128, 0.5, 128}),
                    Cuboid({90, 0.5 - Bit(6), 31}, {91, 1.5, 32}), kOverlapping, -Bit(6)});
  cases->push_back({"dimforge/parry#430", Cuboid({-512, -1, -512}, {512, 0, 512}),
                    Octahedron({300, 0.5 + Bit(10), -411}, 0.5), kSeparated, Bit(10)});
  cases->push_back({"jrouwe/JoltPhysics#671", Cuboid({-5, -1, -5}, {5, 0, 5}),
                    Cuboid({1, Bit(11), 2}, {2, 1, 3}), kSeparated, Bit(11), 0, kTurned});
}

void AddHulls(std::vector<Case>* cases) {
  const auto [left, right] = FacingHulls(0.125);
  cases->push_back({"google-deepmind/mujoco#3383", left, right, kSeparated, 0.125, 0, kTurned});
  const Points off_center = Cuboid({0.25, 0.125, -0.5}, {0.375, 0.25, -Bit(9)});
  cases->push_back({"newton-physics/newton#2622",
                    {0.125, 0, 0, 0.5, 0.125, 0, 0.25, 0.5, 0},
                    off_center,
                    kSeparated,
                    Bit(9)});
  cases->push_back({"newton-physics/newton#3773",
                    {-100, -100, 0, 200, -100, 0, -100, 200, 0},
                    Prism(90, -40, -Bit(4), 1),
                    kOverlapping,
                    -Bit(4)});
  cases->push_back(
      {"bepu/bepuphysics2#417", Prism(0, 0, -2, 2), Prism(2.5, 0.5, -2, 2), kOverlapping, -1.5});
  cases->push_back({"NVIDIA-Omniverse/PhysX#126", Octahedron({0, 0, 0}, 1),
                    Cuboid({1, -0.5, -0.5}, {2, 0.5, 0.5}), kTouching, 0});
  cases->push_back({"coal-library/coal#325",
                    {0, 0, 0, -1, 0, 0, -1, 1, 0, -1, 0, 1},
                    {0, 0, 0, 1, 0, 0, 1, 2, 0, 1, 0, 2},
                    kTouching,
                    0});
  cases->push_back({"coal-library/coal#53",
                    {0, 0, 0, 4, 0, 0, 0, 4, 0},
                    {1, 1, Bit(20), 5, 1, Bit(20), 1, 5, Bit(20)},
                    kSeparated,
                    Bit(20)});
  // The midpoints of a tetrahedron's edges, some of them a little outside.
  cases->push_back({"FEniCS/dolfinx#3653",
                    {0, 0,        0, 4, 0, 0,        0, 4, 0, 0,           0, 4,
                     2, -Bit(40), 0, 2, 0, -Bit(40), 0, 2, 2, 2 + Bit(40), 2, 0},
                    {-1, 1, 1},
                    kSeparated,
                    1});
  // Triangular prisms whose corners differ in the last digits.
  cases->push_back({"kroitor/gjk.c#5",
                    {4, 11, 0, 5, 5, 0, 9, 9, 0, 4, 11, 1, 5, 5, 1, 9, 9, 1},
                    {4 + Bit(18), 11 - Bit(17), 0, 5 - Bit(17), 5 + Bit(18), 0, 9, 9 + Bit(19), 0,
                     4 + Bit(18), 11 - Bit(17), 1, 5 - Bit(17), 5 + Bit(18), 1, 9, 9 + Bit(19), 1},
                    kOverlapping,
                    kNoClosedForm});
}

void AddDegenerateHulls(std::vector<Case>* cases) {
  cases->push_back({"scipy/scipy#14185",
                    {0, 1, 0, 1, 0x1p14, 0, 2, 0x1p28, 0, 2, -1, 0, 0, -1, 0},
                    {0, 1, 0},
                    kTouching,
                    0,
                    0,
                    {1, 0, 0, 0},
                    4});
  cases->push_back({"scipy/scipy#9852",
                    Repeated({1e-15, 0.125, 0, 1e-30, -1e-13, 0, -1e-160, 0, 0, 0, 0, 0}, 5),
                    {0, 0, 0},
                    kTouching,
                    0,
                    0,
                    {1, 0, 0, 0},
                    3});
  cases->push_back({"qhull/qhull#166",
                    {0, 0, 0, 2e139, 0, 0, 0, 3e139, 0, 0, 0, 1e-320},
                    {0, 0, 1e-320},
                    kTouching,
                    0,
                    0,
                    {1, 0, 0, 0},
                    4});
  // Points in a vertical plane, far from the origin; the probe is (4, -3, 0) from it.
  const double x = 2'097'152.5;
  const double y = 1'048'576.25;
  cases->push_back({"mikedh/trimesh#1784",
                    {x, y, 262.3125, x, y, 259.1875, x + 3, y + 4, 259.1875, x + 3, y + 4, 220.75,
                     x - 6, y - 8, 220.75, x - 6, y - 8, 262.3125},
                    {x + 4, y - 3, 240},
                    kSeparated,
                    5,
                    0,
                    {1, 0, 0, 0},
                    5});
  // Three of the four points are collinear.
  cases->push_back({"PointCloudLibrary/pcl#6161",
                    {0, 0, 0, 7, 7, 0, 0, 16, 0, 0, 8, 0},
                    {1, 8, 0},
                    kTouching,
                    0,
                    0,
                    {1, 0, 0, 0},
                    3});
  cases->push_back({"PointCloudLibrary/pcl#6382",
                    {0, 0, 0, 1, 2, 2, 2, 4, 4, 3, 6, 6, 1, 2, 2},
                    {5, 10, 10},
                    kSeparated,
                    6,
                    0,
                    {1, 0, 0, 0},
                    2});
  Points grid;
  for (int i = 0; i < 49; ++i) {
    grid.insert(grid.end(), {i % 7 + 0.5, i / 7 - 3.0, 2.0 * (i % 7) - (i / 7)});
  }
  cases->push_back({"isl-org/Open3D#2911", grid, {3.5, 0, 3}, kTouching, 0, 0, {1, 0, 0, 0}, 4});
}

}  // namespace

std::vector<Case> ReportedCases() {
  std::vector<Case> cases;
  AddBoxes(&cases);
  AddHulls(&cases);
  AddDegenerateHulls(&cases);
  return cases;
}

}  // namespace hulld
