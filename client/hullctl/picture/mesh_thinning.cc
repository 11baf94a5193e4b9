#include "client/hullctl/picture/mesh_thinning.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace hulld {
namespace {

struct Clustering {
  std::vector<DrawnPoint> vertices;
  std::vector<DrawnTriangle> triangles;
};

uint64_t CellOf(const DrawnPoint& p, int cells) {
  uint64_t key = 0;
  for (const double coordinate : p) {
    const double place = (coordinate + 1) / 2 * cells;
    key = (key << 16) | static_cast<uint64_t>(std::clamp(place, 0.0, cells - 1.0));
  }
  return key;
}

Clustering Cluster(const std::vector<DrawnPoint>& vertices,
                   const std::vector<DrawnTriangle>& triangles, int cells) {
  Clustering result;
  std::unordered_map<uint64_t, uint32_t> index_of_cell;
  std::vector<uint32_t> cluster_of(vertices.size());
  std::vector<double> members;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const uint32_t next = static_cast<uint32_t>(result.vertices.size());
    const auto [entry, added] = index_of_cell.emplace(CellOf(vertices[i], cells), next);
    if (added) {
      result.vertices.push_back({0, 0, 0});
      members.push_back(0);
    }
    cluster_of[i] = entry->second;
    for (size_t axis = 0; axis < 3; ++axis)
      result.vertices[entry->second][axis] += vertices[i][axis];
    members[entry->second] += 1;
  }
  for (size_t i = 0; i < members.size(); ++i) {
    for (double& coordinate : result.vertices[i]) coordinate /= members[i];
  }
  for (const DrawnTriangle& triangle : triangles) {
    DrawnTriangle moved = {cluster_of[triangle[0]], cluster_of[triangle[1]],
                           cluster_of[triangle[2]]};
    if (moved[0] == moved[1] || moved[1] == moved[2] || moved[2] == moved[0]) continue;
    // Rotates the lowest index first, so that equal triangles compare equal; preserves the
    // orientation.
    std::rotate(moved.begin(), std::min_element(moved.begin(), moved.end()), moved.end());
    result.triangles.push_back(moved);
  }
  std::sort(result.triangles.begin(), result.triangles.end());
  result.triangles.erase(std::unique(result.triangles.begin(), result.triangles.end()),
                         result.triangles.end());
  return result;
}

}  // namespace

void ThinOut(size_t limit, std::vector<DrawnPoint>* vertices,
             std::vector<DrawnTriangle>* triangles) {
  if (triangles->size() <= limit) return;
  Clustering result;
  int cells = 512;
  do {
    result = Cluster(*vertices, *triangles, cells);
    cells = cells * 4 / 5;
  } while (result.triangles.size() > limit && cells > 1);
  *vertices = std::move(result.vertices);
  *triangles = std::move(result.triangles);
}

}  // namespace hulld
