#include "client/enclosure/mesh_volume.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "client/enclosure/convex_region.h"
#include "client/enclosure/exact_number.h"

namespace hulld {
namespace {

using Point = std::array<double, 3>;

// Returns for each vertex a representative of all vertices at the same coordinates.
std::vector<uint32_t> Merged(const TriangleMesh& mesh) {
  std::vector<uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  // -0 and 0 compare equal because they are the same position.
  std::sort(order.begin(), order.end(),
            [&mesh](uint32_t a, uint32_t b) { return mesh.vertices[a] < mesh.vertices[b]; });
  std::vector<uint32_t> merged(order.size());
  for (size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && mesh.vertices[order[i]] == mesh.vertices[order[i - 1]];
    merged[order[i]] = same ? merged[order[i - 1]] : order[i];
  }
  return merged;
}

// Returns six times the volume of the tetrahedron with the origin.
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
  // Each traversal of an edge: its lower and its higher vertex, and 1 if it went up.
  std::vector<std::array<uint32_t, 3>> passages;
  for (const auto& triangle : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t from = merged[triangle[i]];
      const uint32_t to = merged[triangle[(i + 1) % 3]];
      if (from != to) passages.push_back({std::min(from, to), std::max(from, to), from < to});
    }
  }
  std::sort(passages.begin(), passages.end());
  for (size_t begin = 0; begin < passages.size();) {
    int64_t balance = 0;
    size_t end = begin;
    for (; end < passages.size() && passages[end][0] == passages[begin][0] &&
           passages[end][1] == passages[begin][1];
         ++end) {
      balance += passages[end][2] == 1 ? 1 : -1;
    }
    if (balance != 0) return false;
    begin = end;
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
