#include "core/query/placed/center_bounds.h"

#include <array>
#include <bit>
#include <span>
#include <vector>

#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
// Cells along a side of a face, a power of two so that corners are exact. A choice: with it half of
// the pairs of round hulls of 512 vertices a few percent apart are settled, and nearly all that are
// deep in each other (observed: relation/ of tests/bench/queries/query_benchmark).
constexpr uint32_t kCoarseSide = 2;
constexpr uint32_t kFineSide = 8;
uint32_t SideFor(size_t vertices) { return vertices < 24 ? kCoarseSide : kFineSide; }
// With more cells than this along a side the gauge is made at every other corner.
constexpr uint32_t kMostGaugedCells = 4;

// The points of a ray that are tried whether they are inside, relative to the ray's part in the
// hull.
constexpr double kShrink[] = {1 - 0x1p-22, 1 - 0x1p-16, 1 - 0x1p-10};
// A portal whose plane the hull exceeds by less than this, relative to its distance, is as good as
// a facet: the bounds between corners are no closer.
constexpr double kLeastGain = 0x1p-8;
// Far more than needed. Observed on points of a sphere, even with a gain of 2^-26: one step to find
// a portal, 5 to 13 to refine it, for 64 to 10000 points.
constexpr int kMostSteps = 64;

// How far apart the directions are along which a portal is guessed, about: the distance between
// points on a sphere.
constexpr double kTilt = 4;
constexpr double kMostTilt = 0.7;

float RoundedUp(double value) {
  const auto rounded = static_cast<float>(value);
  if (!(static_cast<double>(rounded) < value)) return rounded;
  // Of positive numbers the next one has the next bits.
  return rounded > 0 ? std::bit_cast<float>(std::bit_cast<uint32_t>(rounded) + 1)
                     : std::nextafter(rounded, kInfinity);
}

// A corner of a cell: its direction, and the first corner that has the same one, on another face
// where faces meet.
struct CornerPlace {
  Vector direction;
  uint32_t twin;
};

// The corners of a cube map, face by face, row by row.
std::vector<CornerPlace> CornersOf(uint32_t side) {
  const uint32_t row = side + 1;
  const double half = 0.5 * side;
  std::vector<CornerPlace> corners;
  corners.reserve(size_t{6} * row * row);
  std::vector<uint32_t> first(size_t{row} * row * row, UINT32_MAX);
  for (uint32_t face = 0; face < 6; ++face) {
    for (uint32_t i = 0; i < row; ++i) {
      for (uint32_t j = 0; j < row; ++j) {
        const Vector n = CubeDirection(face, i / half - 1, j / half - 1);
        const auto place = [&](int axis) { return static_cast<uint32_t>((n[axis] + 1) * half); };
        uint32_t& twin = first[(place(0) * row + place(1)) * row + place(2)];
        twin = std::min(twin, static_cast<uint32_t>(corners.size()));
        corners.push_back({n, twin});
      }
    }
  }
  return corners;
}

// Made once, as they are the same for all hulls.
std::span<const CornerPlace> Corners(uint32_t side) {
  static const auto& fine = *new std::vector<CornerPlace>(CornersOf(kFineSide));
  static const auto& coarse = *new std::vector<CornerPlace>(CornersOf(kCoarseSide));
  return side == kFineSide ? fine : coarse;
}

// Whether p is in the tetrahedron of a point o strictly inside a hull and a triangle of a facet.
// Exact.
bool IsInCone(const Vector& o, const Vector& a, const Vector& b, const Vector& c, const Vector& p) {
  return Orient3d(o, a, b, p) >= 0 && Orient3d(o, b, c, p) >= 0 && Orient3d(o, c, a, p) >= 0 &&
         Orient3d(a, b, c, p) <= 0;
}

// Whether p is in the tetrahedron of four points. Exact; false for a flat one.
bool IsInTetrahedron(const std::array<Vector, 4>& t, const Vector& p) {
  const int turn = Orient3d(t[0], t[1], t[2], t[3]);
  return turn != 0 && turn * Orient3d(p, t[1], t[2], t[3]) >= 0 &&
         turn * Orient3d(t[0], p, t[2], t[3]) >= 0 && turn * Orient3d(t[0], t[1], p, t[3]) >= 0 &&
         turn * Orient3d(t[0], t[1], t[2], p) >= 0;
}

// Looks from a point o inside a hull along rays, by the hull's support points alone.
class Lookout {
 public:
  Lookout(std::span<const Vector> points, const Vector& o, const SupportMap& support)
      : points_(points),
        o_(o),
        support_(support),
        tilt_(std::min(kMostTilt, kTilt / std::sqrt(static_cast<double>(points.size())))) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vector n = Vector::Unit(axis);
      const double width = support.Farthest(n).value + support.Farthest(Vector(-n)).value;
      per_width_[axis] = 1 / width;
    }
  }

  // Whether o is in the hull: in a tetrahedron of its points, exactly. May say false of a point
  // near the boundary.
  bool IsInside() const {
    const Vector first(1, 0.3, 0.2);
    std::array<Vector, 4> t = {Farthest(first), Farthest(-first), o_, o_};
    t[2] = FartherOf(AnyPerpendicularTo(t[1] - t[0]), t[0]);
    Vector n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double side = n.dot(o_ - t[0]);
    t[3] = side == 0 ? FartherOf(n, t[0]) : Farthest(side > 0 ? n : Vector(-n));
    // Walks through the face that o is beyond, while there is one.
    for (int step = 0; step < kMostSteps; ++step) {
      if (IsInTetrahedron(t, o_)) return true;
      double farthest = 0;
      int off = -1;
      Vector outwards;
      for (int i = 0; i < 4; ++i) {
        const Vector& p = t[(i + 1) % 4];
        n = (t[(i + 2) % 4] - p).cross(t[(i + 3) % 4] - p);
        if (n.dot(t[i] - p) > 0) n = -n;
        const double beyond = n.dot(o_ - p) / n.norm();
        if (!(beyond > farthest)) continue;
        farthest = beyond;
        off = i;
        outwards = n;
      }
      if (off < 0) return false;
      t[off] = Farthest(outwards);
    }
    return false;
  }

  // A value t, almost as large as possible, such that o + t d as rounded is in the hull; 0 when
  // none was found. Requires o in the hull. Fast when the ray is near the last one.
  double Reach(const Vector& d) {
    // Rays through corners and edges, as symmetric hulls have many, would have no portal of their
    // own: one beside them is looked for, on the other side if the first will not do.
    constexpr double kBeside = 0x1p-24;
    const Vector beside = d.cwiseAbs().maxCoeff() * kBeside * Vector(0.7, -0.4, 0.9);
    const Vector across = kBeside * d.cross(Vector(0.9, 0.7, 0.4));
    for (const Vector& off : {beside, Vector(-beside), across, Vector(-across)}) {
      const PlainVector ray = Vector(d + off);
      if (!Sees(ray) && !GuessPortal(ray) && !FindPortal(ray)) continue;
      if (!RefinePortal(ray)) continue;
      const PlainVector normal = NormalOfPortal();
      const double t = Dot(normal, p_) / Dot(normal, PlainVector(d));
      for (const double shrink : kShrink) {
        const Vector point = o_ + (t * shrink) * d;
        if (!point.allFinite()) return 0;
        if (IsInCone(o_, points_[ids_[0]], points_[ids_[1]], points_[ids_[2]], point)) {
          return t * shrink;
        }
      }
    }
    return 0;
  }

 private:
  static Vector AnyPerpendicularTo(const Vector& v) {
    int least = 0;
    v.cwiseAbs().minCoeff(&least);
    return v.cross(Vector::Unit(least));
  }
  static double Turn(const PlainVector& p, const PlainVector& q, const PlainVector& d) {
    return Dot(Cross(p, q), d);
  }

  Vector Farthest(const Vector& n) const { return points_[support_.Farthest(n).vertex]; }
  // Of the farthest points along n and against it the one that is farther from p.
  Vector FartherOf(const Vector& n, const Vector& p) const {
    const Vector along = Farthest(n);
    const Vector against = Farthest(-n);
    return n.dot(along - p) >= -n.dot(against - p) ? along : against;
  }
  PlainVector From(uint32_t id) const { return PlainVector(points_[id]) - PlainVector(o_); }
  void LookUp(const PlainVector& n, int corner, PlainVector& y) {
    ids_[corner] = support_.Farthest(n).vertex;
    y = From(ids_[corner]);
  }

  // Whether the ray passes through the portal.
  bool Sees(const PlainVector& d) const {
    return found_ && Turn(p_, q_, d) > 0 && Turn(q_, r_, d) > 0 && Turn(r_, p_, d) > 0;
  }
  PlainVector NormalOfPortal() const { return Cross(q_ - p_, r_ - p_); }

  // Tries the farthest points along three directions around the one that an ellipsoid of the hull's
  // widths would have as its normal where the ray leaves it.
  bool GuessPortal(const PlainVector& d) {
    // On a sphere, to which widths scale that ellipsoid.
    const Vector n = Vector(d.x, d.y, d.z).cwiseProduct(per_width_).normalized();
    const Vector u = tilt_ * AnyPerpendicularTo(n).normalized();
    const Vector v = n.cross(u);
    const auto look_up = [&](double along_u, double along_v, int corner, PlainVector& y) {
      LookUp(Vector((n + along_u * u + along_v * v).cwiseProduct(per_width_)), corner, y);
    };
    // An equilateral triangle.
    look_up(1, 0, 0, p_);
    look_up(-0.5, 0.866, 1, q_);
    look_up(-0.5, -0.866, 2, r_);
    found_ = true;
    return Sees(d);
  }

  // Finds a triangle that the ray passes through: a point p along the ray, q and r on either side
  // of the plane through p and the ray, moved until their segment passes beyond the ray.
  bool FindPortal(const PlainVector& d) {
    found_ = false;
    LookUp(d, 0, p_);
    PlainVector n = Cross(p_, d);
    if (!(LargestComponent(n) > 0x1p-40 * LargestComponent(p_))) n = AnyPerpendicularTo(d);
    LookUp(-n, 1, q_);
    LookUp(n, 2, r_);
    for (int step = 0; step < kMostSteps; ++step) {
      n = Cross(r_, q_);
      if (Dot(n, d) <= 0) return found_ = true;
      const uint32_t id = support_.Farthest(n).vertex;
      const PlainVector w = From(id);
      const bool is_left = Turn(p_, w, d) > 0;
      if (ids_[is_left ? 1 : 2] == id) return false;
      ids_[is_left ? 1 : 2] = id;
      (is_left ? q_ : r_) = w;
    }
    return false;
  }

  // Moves the portal outwards until it is a facet, about.
  bool RefinePortal(const PlainVector& d) {
    for (int step = 0; step < kMostSteps; ++step) {
      const PlainVector n = NormalOfPortal();
      // Below 0 while the ray's other half passes through the portal.
      const double height = Dot(n, p_);
      const uint32_t id = support_.Farthest(n).vertex;
      const PlainVector w = From(id);
      const double gain = Dot(n, w) - height;
      if (!(gain > kLeastGain * std::abs(height))) return height > 0;
      const double by_p = Turn(p_, w, d);
      const double by_q = Turn(q_, w, d);
      const double by_r = Turn(r_, w, d);
      if (by_p <= 0 && by_q >= 0) {
        ids_[2] = id;
        r_ = w;
      } else if (by_q <= 0 && by_r >= 0) {
        ids_[0] = id;
        p_ = w;
      } else if (by_r <= 0 && by_p >= 0) {
        ids_[1] = id;
        q_ = w;
      } else {
        return false;
      }
    }
    return false;
  }

  const std::span<const Vector> points_;
  const Vector o_;
  const SupportMap& support_;
  // How far GuessPortal looks to the sides.
  const double tilt_;
  Vector per_width_;
  // The portal: points of the hull and, relative to o, where they are; turning left seen from
  // outside.
  bool found_ = false;
  std::array<uint32_t, 3> ids_ = {};
  PlainVector p_;
  PlainVector q_;
  PlainVector r_;
};

}  // namespace

CenterBounds::CenterBounds(std::span<const Vector> points, int dimension, const Vector& center,
                           double max_abs, const SupportMap& support) {
  if (dimension < 3) return;
  double radius = 0;
  for (const Vector& v : points) radius = std::max(radius, (v - center).cwiseAbs().maxCoeff());
  // Such radii are beyond what pairs may have, or so small against the coordinates that rounding
  // counts.
  if (!IsFilterSize(radius)) return;
  if (radius < kCenterLeastRadius * max_abs) return;
  side_ = SideFor(points.size());
  half_ = 0.5 * side_;
  unit_ = std::ldexp(1.0, std::ilogb(radius));
  per_unit_ = 1 / unit_;
  corners_.resize(size_t{6} * (side_ + 1) * (side_ + 1), {kInfinity, kUnknown});
  AddSupports(center, radius, support);
  AddGauges(points, center, max_abs, support);
}

void CenterBounds::AddSupports(const Vector& center, double radius, const SupportMap& support) {
  const double margin = kCenterMargin * radius;
  const std::span<const CornerPlace> places = Corners(side_);
  for (uint32_t i = 0; i < corners_.size(); ++i) {
    const auto& [n, twin] = places[i];
    if (twin != i) {
      corners_[i].support = corners_[twin].support;
      continue;
    }
    const double reach = support.Farthest(n).value - n.dot(center);
    corners_[i].support = RoundedUp((reach + margin) * per_unit_);
  }
}

void CenterBounds::AddGauges(std::span<const Vector> points, const Vector& center, double max_abs,
                             const SupportMap& support) {
  Lookout lookout(points, center, support);
  if (!lookout.IsInside()) return;
  const std::span<const CornerPlace> places = Corners(side_);
  const uint32_t row = side_ + 1;
  const uint32_t step = side_ > kMostGaugedCells ? 2 : 1;
  double least = std::numeric_limits<double>::infinity();
  for (uint32_t line = 0; line < 6 * row && least > 0; line += line % row == side_ ? 1 : step) {
    for (uint32_t i = line * row; i <= line * row + side_ && least > 0; i += step) {
      if (places[i].twin != i) {
        corners_[i].gauge = corners_[places[i].twin].gauge;
        continue;
      }
      const double t = lookout.Reach(places[i].direction);
      least = std::min(least, t);
      if (t > 0) corners_[i].gauge = RoundedUp((1 + kCenterMargin) * unit_ / t);
    }
  }
  // All or none: only a centre that is surrounded is strictly inside, up to rounding.
  if (!(least >= kCenterLeastRadius * max_abs)) {
    for (Corner& corner : corners_) corner.gauge = kUnknown;
    return;
  }
  largest_gauge_ = (1 + kCenterMargin) / least;
  if (step == 1) return;
  for (uint32_t i = 0; i < corners_.size(); ++i) {
    const uint32_t down = i / row % row % 2 * row;
    const uint32_t right = i % row % 2;
    if (down == 0 && right == 0) continue;
    // The mean of the two or four around it, which are as far on either side.
    const auto gauge = [&](uint32_t corner) { return double{corners_[corner].gauge}; };
    const double sum = gauge(i - down - right) + gauge(i - down + right) + gauge(i + down - right) +
                       gauge(i + down + right);
    corners_[i].gauge = RoundedUp(0.25 * sum);
  }
}

}  // namespace hulld
