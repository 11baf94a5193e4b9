#ifndef HULLD_TESTS_CORE_CHECKS_POINT_SETS_H_
#define HULLD_TESTS_CORE_CHECKS_POINT_SETS_H_

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/hull/hull.h"

namespace hulld {

// Returns the fixed seed of a test, plus $HULLD_TEST_SEED if set, to try other inputs.
uint64_t TestSeed(uint64_t fixed);

// Random numbers for tests: equal on every platform, unlike the distributions of <random>.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  // Returns an integer in [0, n).
  int Below(int n) { return static_cast<int>(engine_() % static_cast<uint64_t>(n)); }
  // Returns an integer in [low, high].
  int Between(int low, int high) { return low + Below(high - low + 1); }
  // Returns a multiple of 2^-53 in [0, 1).
  double Unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double Real(double low, double high) { return low + (high - low) * Unit(); }
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

// Returns n points of the lattice {0 .. side-1}^3, with repetition.
std::vector<Vector> RandomLatticePoints(Random& random, int n, int side);
// Returns n points of a random affine image of a lattice of the given dimension (0 .. 3), with
// small integer coordinates: exactly on a random line or in a random tilted plane.
std::vector<Vector> RandomFlatPoints(Random& random, int n, int dimension);
// Returns all n^3 points of {0 .. n-1}^3, times step.
std::vector<Vector> LatticeCube(int n, double step);
// Returns the points of LatticeCube on its surface.
std::vector<Vector> LatticeCubeSurface(int n);

std::vector<Vector> RandomInBall(Random& random, int n, double radius);
std::vector<Vector> RandomOnSphere(Random& random, int n, double radius);
std::vector<Vector> RandomInCube(Random& random, int n, double half_side);
std::vector<Vector> FibonacciSphere(int n);
// Returns all integer points with x^2 + y^2 + z^2 == radius_squared.
std::vector<Vector> IntegerSphere(int radius_squared);
// Returns the points (i, j, i^2 + j^2) for |i|, |j| <= n: all extreme, with n^2 coplanar squares
// below.
std::vector<Vector> IntegerParaboloid(int n);

std::vector<Vector> Scaled(std::vector<Vector> points, double factor);
std::vector<Vector> Shifted(std::vector<Vector> points, const Vector& offset);
std::vector<Vector> Concatenated(std::vector<Vector> a, const std::vector<Vector>& b);
void Shuffle(Random& random, std::vector<Vector>& points);

// Returns the vertices of a real mesh: `name` in $HULLD_DATA or the data directory next to the
// source tree, otherwise the spider of Debian's assimp-testmodels. nullopt if neither exists.
std::optional<std::vector<Vector>> MeshVertices(const std::string& name);

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_POINT_SETS_H_
