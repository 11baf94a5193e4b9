#ifndef HULLD_CLIENT_HULLCTL_LOAD_POINT_GENERATOR_H_
#define HULLD_CLIENT_HULLCTL_LOAD_POINT_GENERATOR_H_

#include <array>
#include <cstdint>
#include <functional>

#include "hulld/v1/geometry.pb.h"

namespace hulld {

// xoshiro256++, with its state filled by splitmix64 from the seed. Source: Blackman and Vigna 2019,
// Scrambled Linear Pseudorandom Number Generators.
class Xoshiro256 {
 public:
  explicit Xoshiro256(uint64_t seed);
  uint64_t Next();
  // Returns a uniform number in [0, 1): a multiple of 2^-53.
  double NextUnit();
  // Returns a uniform number in [-1, 1).
  double NextSigned() { return 2 * NextUnit() - 1; }

 private:
  std::array<uint64_t, 4> state_;
};

enum class Shape { kBall, kSphere, kCube, kLattice };

struct CloudOptions {
  Shape shape = Shape::kBall;
  uint64_t count = 0;
  uint64_t seed = 1;
  // Radius of ball and sphere.
  double radius = 1;
  // Edge of the cube; distance between neighbors of the lattice.
  double size = 1;
  // Center of ball, sphere, and cube; first point of the lattice.
  std::array<double, 3> center = {0, 0, 0};
};

// Passes `count` points to `take`: uniform in the ball, on the sphere, or in the cube; or the first
// points, x fastest, of the smallest cubic lattice with at least that many. The points are the same
// on every platform for the same options, because only operations that IEEE 754 rounds correctly
// are used. Points of the sphere lie on it up to rounding.
void GenerateCloud(const CloudOptions& options,
                   const std::function<void(const std::array<double, 3>&)>& take);

// Returns these points.
v1::PointBlock CloudPoints(const CloudOptions& options);

// Returns the smallest k with k^3 >= count.
uint64_t LatticeSide(uint64_t count);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_LOAD_POINT_GENERATOR_H_
