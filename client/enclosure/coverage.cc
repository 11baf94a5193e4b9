#include "client/enclosure/coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "client/enclosure/convex_region.h"
#include "client/enclosure/exact_number.h"

namespace hulld {
namespace {

using Point = std::array<double, 3>;

// The point (x/w, y/w, z/w), w > 0, without a common divisor.
struct Corner {
  BigVector xyz;
  BigInteger w;
};
// A convex polygon; a segment or a point if the triangle is degenerate.
using Polygon = std::vector<Corner>;

void Reduce(Corner* corner) {
  BigInteger divisor = corner->w;
  for (const BigInteger& x : corner->xyz) divisor = gcd(divisor, x);
  if (divisor <= 1) return;
  for (BigInteger& x : corner->xyz) x /= divisor;
  corner->w /= divisor;
}

// Returns w times the height of the corner above the boundary.
BigInteger HeightOf(const HalfSpace& half, const Corner& corner) {
  return Dot(half.normal(), corner.xyz) - half.offset() * corner.w;
}

// Returns the point where the segment from a, at height h < 0, to b, at height k > 0, crosses the
// boundary.
Corner Crossing(const Corner& a, const BigInteger& h, const Corner& b, const BigInteger& k) {
  Corner crossing = {k * a.xyz - h * b.xyz, k * a.w - h * b.w};
  Reduce(&crossing);
  return crossing;
}

// The two parts of a polygon. The outer part is empty if no corner is strictly outside. Otherwise
// the inner part is empty if no corner is strictly inside: the part on the boundary has a lower
// dimension than the polygon, and because pieces are closed, whatever covers the rest covers it,
// too.
struct Parts {
  Polygon inside;
  Polygon outside;
};

Parts Cut(const Polygon& polygon, const HalfSpace& half) {
  Parts parts;
  std::vector<BigInteger> heights;
  for (const Corner& corner : polygon) heights.push_back(HeightOf(half, corner));
  const auto is_above = [](const BigInteger& h) { return h > 0; };
  const auto is_below = [](const BigInteger& h) { return h < 0; };
  if (std::none_of(heights.begin(), heights.end(), is_above)) {
    parts.inside = polygon;
    return parts;
  }
  if (std::none_of(heights.begin(), heights.end(), is_below)) {
    parts.outside = polygon;
    return parts;
  }
  for (size_t i = 0; i < polygon.size(); ++i) {
    const size_t next = (i + 1) % polygon.size();
    if (heights[i] <= 0) parts.inside.push_back(polygon[i]);
    if (heights[i] >= 0) parts.outside.push_back(polygon[i]);
    if (heights[i] < 0 && heights[next] > 0) {
      parts.inside.push_back(Crossing(polygon[i], heights[i], polygon[next], heights[next]));
      parts.outside.push_back(parts.inside.back());
    } else if (heights[i] > 0 && heights[next] < 0) {
      parts.inside.push_back(Crossing(polygon[next], heights[next], polygon[i], heights[i]));
      parts.outside.push_back(parts.inside.back());
    }
  }
  return parts;
}

// Returns the distance of p from the triangle a b c. Source: Ericson 2005, Real-Time Collision
// Detection, 5.1.5.
double DistanceToTriangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  const auto minus = [](const Point& x, const Point& y) {
    return Point{x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  };
  const auto dot = [](const Point& x, const Point& y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const auto from = [&](const Point& origin, const Point& u, double s, const Point& v, double t) {
    const Point d = minus(p, origin);
    return std::hypot(d[0] - s * u[0] - t * v[0], d[1] - s * u[1] - t * v[1],
                      d[2] - s * u[2] - t * v[2]);
  };
  const Point ab = minus(b, a);
  const Point ac = minus(c, a);
  const Point ap = minus(p, a);
  const double d1 = dot(ab, ap);
  const double d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return from(a, ab, 0, ac, 0);
  const Point bp = minus(p, b);
  const double d3 = dot(ab, bp);
  const double d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return from(b, ab, 0, ac, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return from(a, ab, d1 / (d1 - d3), ac, 0);
  const Point cp = minus(p, c);
  const double d5 = dot(ab, cp);
  const double d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return from(c, ab, 0, ac, 0);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return from(a, ab, 0, ac, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && (d4 - d3) + (d5 - d6) > 0) {
    return from(b, minus(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)), ac, 0);
  }
  const double sum = va + vb + vc;
  if (sum == 0) return std::min(from(a, ab, 0, ac, 0), from(b, ab, 0, ac, 0));
  return from(a, ab, vb / sum, ac, vc / sum);
}

// Returns the vertices in the world, rounded.
std::vector<Point> VerticesOf(const CoveringPiece& piece) {
  std::vector<Point> vertices;
  const std::vector<double>& xyz = piece.mesh->xyz;
  for (size_t i = 0; i + 2 < xyz.size(); i += 3) {
    const RigidPose X_WV = Compose(piece.X_WH, {1, 0, 0, 0, xyz[i], xyz[i + 1], xyz[i + 2]});
    vertices.push_back({X_WV[4], X_WV[5], X_WV[6]});
  }
  return vertices;
}

// Returns the distance of an outside point from a piece with these vertices: that of the nearest
// facet.
double DistanceTo(const HullMesh& piece, const std::vector<Point>& vertices, const Point& p) {
  double least = std::numeric_limits<double>::infinity();
  if (piece.facet_sizes.empty() && !vertices.empty()) {
    return DistanceToTriangle(p, vertices.front(), vertices.back(), vertices.back());
  }
  size_t begin = 0;
  for (const uint32_t size : piece.facet_sizes) {
    const Point a = vertices[piece.facet_indices[begin]];
    for (size_t i = 2; i < size; ++i) {
      least = std::min(least, DistanceToTriangle(p, a, vertices[piece.facet_indices[begin + i - 1]],
                                                 vertices[piece.facet_indices[begin + i]]));
    }
    begin += size;
  }
  return least;
}

// Covers one mesh with prepared pieces.
class Cover {
 public:
  Cover(const std::vector<CoveringPiece>& pieces, const TriangleMesh& mesh)
      : pieces_(pieces), mesh_(mesh) {
    for (const CoveringPiece& piece : pieces) {
      grid_.Include(piece.mesh->xyz);
      grid_.Include(std::span(piece.X_WH).last(3));
    }
    for (const Point& p : mesh.vertices) grid_.Include(p);
  }

  absl::Status Prepare() {
    for (const CoveringPiece& piece : pieces_) {
      auto region = ConvexRegion::Make(*piece.mesh, piece.X_WH, grid_);
      if (!region.ok()) return region.status();
      regions_.push_back(*std::move(region));
      vertices_.push_back(VerticesOf(piece));
    }
    for (const Point& p : mesh_.vertices) {
      on_grid_.push_back(OnGrid(p, grid_));
      std::vector<bool>& held = holds_.emplace_back();
      for (const ConvexRegion& region : regions_)
        held.push_back(region.Contains(p, on_grid_.back()));
    }
    return absl::OkStatus();
  }

  void Take(size_t triangle, Coverage* coverage) {
    const auto& corners = mesh_.triangles[triangle];
    for (size_t piece = 0; piece < regions_.size(); ++piece) {
      if (std::all_of(corners.begin(), corners.end(),
                      [&](uint32_t v) { return holds_[v][piece]; })) {
        return;
      }
    }
    ++coverage->clipped;
    Polygon whole;
    for (const uint32_t v : corners) whole.push_back({on_grid_[v], 1});
    std::vector<Polygon> left = {whole};
    for (size_t piece = 0; piece < regions_.size() && !left.empty(); ++piece) {
      Subtract(regions_[piece], corners, &left);
    }
    if (left.empty()) return;
    coverage->uncovered.push_back(Measure(triangle, left));
    coverage->distance = std::max(coverage->distance, coverage->uncovered.back().distance);
  }

 private:
  // Replaces the polygons by their parts outside of the region.
  void Subtract(const ConvexRegion& region, const std::array<uint32_t, 3>& triangle,
                std::vector<Polygon>* left) const {
    if (region.empty()) return;
    // Only half spaces that cut the triangle matter. If one has no corner strictly inside but one
    // outside, no part of the triangle is inside.
    std::vector<const HalfSpace*> cutting;
    for (const HalfSpace& half : region.half_spaces()) {
      int least = 1;
      int max_side = -1;
      for (const uint32_t v : triangle) {
        const int side = half.Side(mesh_.vertices[v], on_grid_[v]);
        least = std::min(least, side);
        max_side = std::max(max_side, side);
      }
      if (max_side <= 0) continue;
      if (least >= 0) return;
      cutting.push_back(&half);
    }
    std::vector<Polygon> outside;
    for (const Polygon& polygon : *left) SubtractFrom(polygon, cutting, &outside);
    *left = std::move(outside);
  }

  static void SubtractFrom(const Polygon& polygon, const std::vector<const HalfSpace*>& cutting,
                           std::vector<Polygon>* outside) {
    Polygon rest = polygon;
    std::vector<Polygon> cut_off;
    for (const HalfSpace* half : cutting) {
      Parts parts = Cut(rest, *half);
      if (!parts.outside.empty()) cut_off.push_back(std::move(parts.outside));
      rest = std::move(parts.inside);
      if (rest.empty()) break;
    }
    // No part is in the region, so the polygon stays whole.
    if (rest.empty()) {
      outside->push_back(polygon);
      return;
    }
    for (Polygon& part : cut_off) outside->push_back(std::move(part));
  }

  Point Rounded(const Corner& corner) const {
    Point p;
    for (size_t i = 0; i < 3; ++i) {
      p[i] = std::ldexp(ApproximateQuotient(corner.xyz[i], corner.w), grid_.exponent());
    }
    return p;
  }

  UncoveredTriangle Measure(size_t triangle, const std::vector<Polygon>& left) const {
    UncoveredTriangle found;
    found.triangle = triangle;
    found.distance = -1;
    for (const Polygon& polygon : left) {
      std::vector<Point> corners;
      for (const Corner& corner : polygon) {
        corners.push_back(Rounded(corner));
        double distance = std::numeric_limits<double>::infinity();
        for (size_t i = 0; i < pieces_.size(); ++i) {
          distance = std::min(distance, DistanceTo(*pieces_[i].mesh, vertices_[i], corners.back()));
        }
        if (distance <= found.distance) continue;
        found.distance = distance;
        found.point = corners.back();
      }
      for (size_t i = 2; i < corners.size(); ++i) {
        found.area += AreaOf(corners[0], corners[i - 1], corners[i]);
      }
    }
    return found;
  }

  static double AreaOf(const Point& a, const Point& b, const Point& c) {
    const Point u = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const Point v = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    return std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                      u[0] * v[1] - u[1] * v[0]) /
           2;
  }

  const std::vector<CoveringPiece>& pieces_;
  const TriangleMesh& mesh_;
  CommonExponent grid_;
  std::vector<ConvexRegion> regions_;
  // The vertices of each piece, for distances.
  std::vector<std::vector<Point>> vertices_;
  std::vector<BigVector> on_grid_;
  // For each vertex, the pieces that contain it.
  std::vector<std::vector<bool>> holds_;
};

}  // namespace

absl::StatusOr<Coverage> CoverMesh(const std::vector<CoveringPiece>& pieces,
                                   const TriangleMesh& mesh,
                                   const std::function<void(uint64_t done)>& progress) {
  Cover cover(pieces, mesh);
  if (absl::Status ready = cover.Prepare(); !ready.ok()) return ready;
  Coverage coverage;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    cover.Take(i, &coverage);
    if (i % 1024 == 0) progress(i);
  }
  return coverage;
}

}  // namespace hulld
