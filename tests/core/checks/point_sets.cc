#include "tests/core/checks/point_sets.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>

#include "tests/source_tree.h"

namespace hulld {
namespace {

std::vector<Vector> ReadObjVertices(const std::string& path) {
  std::vector<Vector> vertices;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string keyword;
    Vector p;
    if (words >> keyword && keyword == "v" && words >> p.x() >> p.y() >> p.z()) {
      vertices.push_back(p);
    }
  }
  return vertices;
}

Vector RandomSmallVector(Random& random) {
  // In separate statements: the evaluation order of arguments is unspecified.
  const int z = random.Between(-3, 3);
  const int y = random.Between(-3, 3);
  const int x = random.Between(-3, 3);
  return Vector(x, y, z);
}

}  // namespace

uint64_t TestSeed(uint64_t fixed) {
  const char* offset = std::getenv("HULLD_TEST_SEED");
  return offset ? fixed + std::strtoull(offset, nullptr, 10) : fixed;
}

std::vector<Vector> RandomLatticePoints(Random& random, int n, int side) {
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const int x = random.Below(side);
    const int y = random.Below(side);
    points.emplace_back(x, y, random.Below(side));
  }
  return points;
}

std::vector<Vector> RandomFlatPoints(Random& random, int n, int dimension) {
  const Vector origin = RandomSmallVector(random);
  std::vector<Vector> directions;
  for (int i = 0; i < dimension; ++i) directions.push_back(RandomSmallVector(random));
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    Vector p = origin;
    for (const Vector& direction : directions) p += direction * random.Between(-2, 2);
    points.push_back(p);
  }
  return points;
}

std::vector<Vector> LatticeCube(int n, double step) {
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) points.emplace_back(i * step, j * step, k * step);
    }
  }
  return points;
}

std::vector<Vector> LatticeCubeSurface(int n) {
  std::vector<Vector> points;
  for (const Vector& p : LatticeCube(n, 1)) {
    if (p.minCoeff() == 0 || p.maxCoeff() == n - 1) points.push_back(p);
  }
  return points;
}

std::vector<Vector> RandomInBall(Random& random, int n, double radius) {
  std::vector<Vector> points;
  while (points.size() < static_cast<size_t>(n)) {
    const double x = random.Real(-1, 1);
    const double y = random.Real(-1, 1);
    const Vector p(x, y, random.Real(-1, 1));
    if (p.squaredNorm() <= 1) points.push_back(p * radius);
  }
  return points;
}

std::vector<Vector> RandomOnSphere(Random& random, int n, double radius) {
  std::vector<Vector> points = RandomInBall(random, n, 1);
  for (Vector& p : points) p = p / p.norm() * radius;
  return points;
}

std::vector<Vector> RandomInCube(Random& random, int n, double half_side) {
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const double x = random.Real(-half_side, half_side);
    const double y = random.Real(-half_side, half_side);
    points.emplace_back(x, y, random.Real(-half_side, half_side));
  }
  return points;
}

std::vector<Vector> FibonacciSphere(int n) {
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n;
    const double r = std::sqrt(1 - z * z);
    const double angle = 2 * std::numbers::pi * i / std::numbers::phi;
    points.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return points;
}

std::vector<Vector> IntegerSphere(int radius_squared) {
  std::vector<Vector> points;
  const int r = static_cast<int>(std::sqrt(radius_squared)) + 1;
  for (int x = -r; x <= r; ++x) {
    for (int y = -r; y <= r; ++y) {
      for (int z = -r; z <= r; ++z) {
        if (x * x + y * y + z * z == radius_squared) points.emplace_back(x, y, z);
      }
    }
  }
  return points;
}

std::vector<Vector> IntegerParaboloid(int n) {
  std::vector<Vector> points;
  for (int i = -n; i <= n; ++i) {
    for (int j = -n; j <= n; ++j) points.emplace_back(i, j, i * i + j * j);
  }
  return points;
}

std::vector<Vector> Scaled(std::vector<Vector> points, double factor) {
  for (Vector& p : points) p *= factor;
  return points;
}

std::vector<Vector> Shifted(std::vector<Vector> points, const Vector& offset) {
  for (Vector& p : points) p += offset;
  return points;
}

std::vector<Vector> Concatenated(std::vector<Vector> a, const std::vector<Vector>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

void Shuffle(Random& random, std::vector<Vector>& points) {
  for (size_t i = points.size(); i > 1; --i) {
    std::swap(points[i - 1], points[static_cast<size_t>(random.Below(static_cast<int>(i)))]);
  }
}

std::optional<std::vector<Vector>> MeshVertices(const std::string& name) {
  const std::string candidates[] = {RealData() / name, "/usr/share/assimp/models/OBJ/spider.obj"};
  for (const std::string& path : candidates) {
    std::vector<Vector> vertices = ReadObjVertices(path);
    if (!vertices.empty()) return vertices;
  }
  return std::nullopt;
}

}  // namespace hulld
