#include "client/hullctl/load/point_generator.h"

#include <bit>
#include <cmath>

namespace hulld {
namespace {

using Point = std::array<double, 3>;

// Rejection: uniform in the cube, kept if in the ball. 52 % are kept.
Point InBall(Xoshiro256* random) {
  for (;;) {
    const Point p = {random->NextSigned(), random->NextSigned(), random->NextSigned()};
    if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] <= 1) return p;
  }
}

// Source: Marsaglia 1972, Choosing a Point from the Surface of a Sphere. Needs no function but the
// square root.
Point OnSphere(Xoshiro256* random) {
  for (;;) {
    const double u = random->NextSigned();
    const double v = random->NextSigned();
    const double s = u * u + v * v;
    if (s >= 1) continue;
    const double scale = 2 * std::sqrt(1 - s);
    return {u * scale, v * scale, 1 - 2 * s};
  }
}

Point InCube(Xoshiro256* random) {
  return {random->NextSigned(), random->NextSigned(), random->NextSigned()};
}

Point OnLattice(uint64_t index, uint64_t side) {
  const uint64_t row = index / side;
  const uint64_t layer = row / side;
  return {static_cast<double>(index % side), static_cast<double>(row % side),
          static_cast<double>(layer)};
}

}  // namespace

Xoshiro256::Xoshiro256(uint64_t seed) {
  for (uint64_t& word : state_) {
    seed += 0x9e3779b97f4a7c15;
    uint64_t z = seed;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    word = z ^ (z >> 31);
  }
}

uint64_t Xoshiro256::Next() {
  const uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Xoshiro256::NextUnit() { return static_cast<double>(Next() >> 11) * 0x1p-53; }

uint64_t LatticeSide(uint64_t count) {
  uint64_t side = static_cast<uint64_t>(std::cbrt(static_cast<double>(count)));
  while (side > 0 && side * side * side >= count) --side;
  while (side * side * side < count) ++side;
  return side;
}

void GenerateCloud(const CloudOptions& options, const std::function<void(const Point&)>& take) {
  Xoshiro256 random(options.seed);
  const uint64_t side = LatticeSide(options.count);
  for (uint64_t i = 0; i < options.count; ++i) {
    Point p{};
    double scale = options.radius;
    switch (options.shape) {
      case Shape::kBall:
        p = InBall(&random);
        break;
      case Shape::kSphere:
        p = OnSphere(&random);
        break;
      case Shape::kCube:
        p = InCube(&random);
        scale = options.size / 2;
        break;
      case Shape::kLattice:
        p = OnLattice(i, side);
        scale = options.size;
        break;
    }
    for (size_t axis = 0; axis < 3; ++axis) p[axis] = p[axis] * scale + options.center[axis];
    take(p);
  }
}

v1::PointBlock CloudPoints(const CloudOptions& options) {
  v1::PointBlock points;
  points.mutable_xyz()->Reserve(static_cast<int>(3 * options.count));
  GenerateCloud(options,
                [&points](const Point& p) { points.mutable_xyz()->Add(p.begin(), p.end()); });
  return points;
}

}  // namespace hulld
