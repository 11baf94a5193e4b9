#include "tests/oracle/cgal_hull.h"

#ifdef HULLD_HAVE_CGAL

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>

namespace hulld::oracle {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

// quickhull triangulates coplanar regions, possibly with points inside facets and edges. A vertex
// of the closed convex surface is extreme iff its triangles lie in three or more planes: around it,
// the plane changes three times or more.
bool IsExtreme(const Mesh& mesh, Mesh::Vertex_index vertex) {
  int plane_changes = 0;
  for (Mesh::Halfedge_index h : mesh.halfedges_around_target(mesh.halfedge(vertex))) {
    const auto apex = mesh.point(mesh.target(mesh.next(h)));
    const auto opposite = mesh.point(mesh.target(mesh.next(mesh.opposite(h))));
    const auto& tail = mesh.point(mesh.source(h));
    if (!CGAL::coplanar(tail, mesh.point(vertex), apex, opposite)) ++plane_changes;
  }
  return plane_changes >= 3;
}

}  // namespace

bool CgalIsAvailable() { return true; }

std::vector<Point> CgalExtremePoints(std::span<const Point> points) {
  std::vector<Kernel::Point_3> input;
  for (const Point& p : points) input.emplace_back(p[0], p[1], p[2]);
  Mesh mesh;
  CGAL::convex_hull_3(input.begin(), input.end(), mesh);
  std::vector<Point> result;
  for (Mesh::Vertex_index v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    // + 0.0 turns -0 into +0.
    if (IsExtreme(mesh, v)) result.push_back({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0});
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace hulld::oracle

#else

namespace hulld::oracle {

bool CgalIsAvailable() { return false; }

std::vector<Point> CgalExtremePoints(std::span<const Point>) { return {}; }

}  // namespace hulld::oracle

#endif
