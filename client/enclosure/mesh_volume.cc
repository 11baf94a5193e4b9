#include "client/enclosure/mesh_volume.h"

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "client/enclosure/convex_region.h"
#include "client/enclosure/exact_number.h"

namespace hulld {
namespace {

using Point = std::array<double, 3>;

// For each vertex, the first one at the same coordinates.
std::vector<uint32_t> Merged(const TriangleMesh& mesh) {
  std::map<Point, uint32_t> first;
  std::vector<uint32_t> merged;
  for (const Point& p : mesh.vertices) {
    // Adding 0 makes -0 the same as 0.
    const Point key = {p[0] + 0, p[1] + 0, p[2] + 0};
    merged.push_back(first.emplace(key, static_cast<uint32_t>(merged.size())).first->second);
  }
  return merged;
}

// Six times the volume of the tetrahedron with the origin.
BigInteger SixfoldVolume(const BigVector& a, const BigVector& b, const BigVector& c) {
  return Dot(a, Cross(b, c));
}

BigInteger SixfoldVolume(const TriangleMesh& mesh, const CommonExponent& grid) {
  BigInteger sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += SixfoldVolume(OnGrid(mesh.vertices[a], grid), OnGrid(mesh.vertices[b], grid),
                         OnGrid(mesh.vertices[c], grid));
  }
  return sum;
}

BigInteger SixfoldVolume(const HullMesh& hull, const CommonExponent& grid) {
  const auto vertex = [&](size_t place) {
    const double* const p = hull.xyz.data() + size_t{3} * hull.facet_indices[place];
    return OnGrid({p[0], p[1], p[2]}, grid);
  };
  BigInteger sum = 0;
  size_t begin = 0;
  for (const uint32_t size : hull.facet_sizes) {
    for (size_t i = 2; i < size; ++i) {
      sum += SixfoldVolume(vertex(begin), vertex(begin + i - 1), vertex(begin + i));
    }
    begin += size;
  }
  return sum;
}

}  // namespace

bool IsClosed(const TriangleMesh& mesh) {
  const std::vector<uint32_t> merged = Merged(mesh);
  // Passes from the lower to the higher vertex, less those back.
  std::map<std::pair<uint32_t, uint32_t>, int64_t> passes;
  for (const auto& triangle : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t from = merged[triangle[i]];
      const uint32_t to = merged[triangle[(i + 1) % 3]];
      if (from < to) ++passes[{from, to}];
      if (from > to) --passes[{to, from}];
    }
  }
  for (const auto& [edge, balance] : passes) {
    if (balance != 0) return false;
  }
  return !mesh.triangles.empty();
}

std::optional<double> VolumeRatio(const HullMesh& hull, const TriangleMesh& mesh) {
  if (hull.facet_sizes.size() < 4 || !IsClosed(mesh)) return std::nullopt;
  CommonExponent grid;
  grid.Include(hull.xyz);
  for (const Point& p : mesh.vertices) grid.Include(p);
  const BigInteger of_mesh = abs(SixfoldVolume(mesh, grid));
  if (of_mesh == 0) return std::nullopt;
  return ApproximateQuotient(abs(SixfoldVolume(hull, grid)), of_mesh);
}

}  // namespace hulld
