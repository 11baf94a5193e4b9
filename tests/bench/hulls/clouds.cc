#include "tests/bench/hulls/clouds.h"

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/source_tree.h"

namespace hulld::bench {
namespace {

constexpr unsigned kSeed = 20240229;

std::vector<Vector> RandomCloud(const std::string& shape, size_t n) {
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector> points;
  points.reserve(n);
  for (size_t i = 0; i < n; ++i) {
    if (shape == "cube") {
      const double x = unit(random);
      const double y = unit(random);
      points.emplace_back(x, y, unit(random));
      continue;
    }
    const double x = normal(random);
    const double y = normal(random);
    const double z = normal(random);
    const double radius = shape == "ball" ? std::cbrt(unit(random)) : 1;
    points.push_back(Vector(x, y, z).normalized() * radius);
  }
  return points;
}

// Points along a spiral, as from a turntable scanner: one in 17 points is a vertex.
std::vector<Vector> Scan(size_t n) {
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(0, 4e-4);
  std::vector<Vector> points;
  points.reserve(n);
  for (size_t i = 0; i < n; ++i) {
    const double z = -1 + 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    const double turn = 2.399963 * static_cast<double>(i);
    const double waist = std::sqrt(1 - z * z);
    const double dents = 0.3 * std::cos(3 * turn) * waist * waist + 0.15 * std::cos(5 * z);
    const double radius = (1 + noise(random)) * (1 + dents);
    points.push_back(radius *
                     Vector(0.6 * waist * std::cos(turn), 0.8 * waist * std::sin(turn), 1.1 * z));
  }
  return points;
}

std::vector<Vector> RotatedLattice(int n) {
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(1, Vector::UnitZ()) * Eigen::AngleAxisd(1, Vector::UnitX()))
          .toRotationMatrix();
  std::vector<Vector> points;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) points.push_back(R * (0.1 * Vector(i, j, k)));
    }
  }
  return points;
}

std::vector<Vector> ObjVertices(const std::string& file) {
  std::ifstream in(RealData() / file);
  std::vector<Vector> points;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    Vector p;
    if (words >> key && key == "v" && words >> p.x() >> p.y() >> p.z()) points.push_back(p);
  }
  return points;
}

}  // namespace

std::vector<Vector> MakeCloud(const std::string& name) {
  const size_t colon = name.find(':');
  const std::string kind = name.substr(0, colon);
  const std::string argument = name.substr(colon + 1);
  if (kind == "mesh") return ObjVertices(argument);
  if (kind == "scan") return Scan(std::stoul(argument));
  if (kind == "lattice") return RotatedLattice(std::stoi(argument));
  return RandomCloud(kind, std::stoul(argument));
}

}  // namespace hulld::bench
