#include "core/hull/surface/surface_check.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// Checks that the corners are three live vertices that span a plane.
const char* FindCornerDefect(const VertexTable& vertices, const SurfaceTriangle& t) {
  for (const VertexId v : t.corners) {
    if (!vertices.IsAlive(v)) return "a corner is not a vertex";
  }
  const auto& [a, b, c] = t.corners;
  if (ProjectionOf(vertices[a], vertices[b], vertices[c]).first < 0) {
    return "a triangle has no area";
  }
  return nullptr;
}

// Checks that the rounded plane contains the corners within its error, and the center lies below.
const char* FindPlaneDefect(const Surface& surface, const VertexTable& vertices,
                            const SurfaceTriangle& t) {
  for (const VertexId v : t.corners) {
    const double height = t.normal.dot(vertices[v]) - t.offset;
    const double bound = static_cast<double>(t.slope) * surface.SizeWith(vertices, vertices[v]);
    if (std::abs(height) > bound) return "a rounded plane misses a corner";
  }
  if (surface.directions() == nullptr) return nullptr;
  const auto& [a, b, c] = t.corners;
  if (Orient3d(vertices[a], vertices[b], vertices[c], surface.directions()->center()) >= 0) {
    return "the center is not inside";
  }
  return nullptr;
}

// Returns the edge of `other` that is edge i of t reversed; 3 if there is none.
size_t TwinOf(const SurfaceTriangle& t, size_t i, const SurfaceTriangle& other) {
  size_t j = 0;
  while (j < 3 && (other.corners[j] != t.corners[(i + 1) % 3] ||
                   other.corners[(j + 1) % 3] != t.corners[i])) {
    ++j;
  }
  return j;
}

// Returns the sign of the dihedral angle at edge j of `other`, with t as its neighbor there: -1 if
// the surface bends inwards, as required, 0 if both lie in one plane.
int BendAt(const VertexTable& vertices, const SurfaceTriangle& t, const SurfaceTriangle& other,
           size_t j) {
  const auto& [a, b, c] = t.corners;
  return Orient3d(vertices[a], vertices[b], vertices[c], vertices[other.corners[(j + 2) % 3]]);
}

const char* FindLinkDefect(const Surface& surface, const VertexTable& vertices, TriangleId id) {
  const SurfaceTriangle& t = surface.triangle(id);
  for (size_t i = 0; i < 3; ++i) {
    const TriangleId next = t.neighbors[i];
    if (next >= surface.id_bound() || !surface.IsAlive(next)) return "a neighbor is not alive";
    const SurfaceTriangle& other = surface.triangle(next);
    const size_t j = TwinOf(t, i, other);
    if (j == 3) return "a neighbor does not traverse the common edge in the opposite direction";
    if (other.neighbors[j] != id) return "a neighbor does not link back";
    if (const char* defect = FindCornerDefect(vertices, other)) return defect;
    const int bend = BendAt(vertices, t, other, j);
    if (bend > 0) return "the surface is not convex at an edge";
    const bool is_flat = (t.flat >> i & 1) != 0;
    if (is_flat != ((other.flat >> j & 1) != 0)) return "an edge is marked flat on one side only";
    if (is_flat && bend != 0) return "an edge marked flat is not flat";
  }
  return nullptr;
}

const char* FindTriangleDefect(const Surface& surface, const VertexTable& vertices, TriangleId id) {
  if (id >= surface.id_bound() || !surface.IsAlive(id)) return "a triangle is not alive";
  const SurfaceTriangle& t = surface.triangle(id);
  if (const char* defect = FindCornerDefect(vertices, t)) return defect;
  if (const char* defect = FindPlaneDefect(surface, vertices, t)) return defect;
  return FindLinkDefect(surface, vertices, id);
}

}  // namespace

const char* FindDefect(const Surface& surface, const VertexTable& vertices,
                       std::span<const TriangleId> ids) {
  if (surface.triangle_count() + surface.free_count() != surface.id_bound()) {
    return "IDs are neither alive nor free";
  }
  if (surface.triangle_count() + 4 != 2 * vertices.size()) return "F is not 2 V - 4";
  for (const TriangleId id : ids) {
    if (const char* defect = FindTriangleDefect(surface, vertices, id)) return defect;
  }
  return nullptr;
}

const char* FindStarDefect(const Surface& surface, const VertexTable& vertices,
                           std::span<const TriangleId> star, VertexId apex) {
  if (const char* defect = FindDefect(surface, vertices, star)) return defect;
  // The triangles, in any order, turn about the new vertex exactly once.
  TriangleId next = star[0];
  for (size_t k = 0; k < star.size(); ++k) {
    if (k > 0 && next == star[0]) return "the new triangles form more than one ring";
    next = surface.triangle(next).neighbors[1];
  }
  if (next != star[0]) return "the new triangles form no ring";
  for (const TriangleId id : star) {
    const SurfaceTriangle& t = surface.triangle(id);
    if (t.corners[2] != apex) return "a new triangle does not end at the new vertex";
    const SurfaceTriangle& beyond = surface.triangle(t.neighbors[0]);
    const bool is_flat = BendAt(vertices, t, beyond, TwinOf(t, 0, beyond)) == 0;
    if (is_flat != ((t.flat & 1) != 0)) return "an edge of the horizon has the wrong flat mark";
  }
  return nullptr;
}

void DcheckSurface([[maybe_unused]] const Surface& surface,
                   [[maybe_unused]] const VertexTable& vertices) {
#ifndef NDEBUG
  std::vector<TriangleId> all;
  surface.ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { all.push_back(id); });
  if (all.size() != surface.triangle_count()) {
    CheckFailed(__FILE__, __LINE__, "the count of triangles is wrong");
  }
  const char* const defect = FindDefect(surface, vertices, all);
  if (defect != nullptr) CheckFailed(__FILE__, __LINE__, defect);
#endif
}

}  // namespace hulld
