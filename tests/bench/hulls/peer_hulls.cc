#include "tests/bench/hulls/peer_hulls.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <cstdio>
#include <iterator>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace hulld::bench {

size_t QhullVertices(std::vector<double>& coordinates) {
  qhT state;
  qhT* qh = &state;
  QHULL_LIB_CHECK
  qh_zero(qh, stderr);
  char options[] = "qhull Qt";
  const int count = static_cast<int>(coordinates.size() / 3);
  const int code = qh_new_qhull(qh, 3, count, coordinates.data(), False, options, nullptr, stderr);
  const auto vertices = code == 0 ? static_cast<size_t>(qh->num_vertices) : 0;
  qh_freeqhull(qh, qh_ALL);
  int current = 0;
  int total = 0;
  qh_memfreeshort(qh, &current, &total);
  return vertices;
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

struct CgalPoints::Data {
  std::vector<Kernel::Point_3> points;
};

CgalPoints::CgalPoints(const std::vector<Vector>& points) : data_(new Data) {
  for (const Vector& p : points) data_->points.emplace_back(p.x(), p.y(), p.z());
}

CgalPoints::~CgalPoints() { delete data_; }

size_t CgalPoints::HullVertices() const {
  CGAL::Surface_mesh<Kernel::Point_3> mesh;
  CGAL::convex_hull_3(data_->points.begin(), data_->points.end(), mesh);
  return mesh.number_of_vertices();
}

struct CgalStream::Data {
  CGAL::Delaunay_triangulation_3<Kernel, CGAL::Fast_location> triangulation;
};

CgalStream::CgalStream() : data_(new Data) {}

CgalStream::~CgalStream() { delete data_; }

void CgalStream::Insert(const Vector& point) {
  data_->triangulation.insert(Kernel::Point_3(point.x(), point.y(), point.z()));
}

size_t CgalStream::HullVertices() const {
  std::vector<decltype(data_->triangulation)::Vertex_handle> vertices;
  data_->triangulation.adjacent_vertices(data_->triangulation.infinite_vertex(),
                                         std::back_inserter(vertices));
  return vertices.size();
}

}  // namespace hulld::bench
