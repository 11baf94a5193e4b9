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

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
// Cells along a side of a face, a power of two so that corners are exact. Not tuned. Observed: it
// settles half of the pairs of round hulls of 512 vertices a few percent apart, and nearly all deep
// overlaps (relation/ of tests/bench/queries/query_benchmark).
constexpr uint32_t kCoarseSide = 2;
constexpr uint32_t kFineSide = 8;
// Each word has one bit for each cell of a face.
static_assert(kFineSide * kFineSide <= 64);
uint32_t SideFor(size_t vertices) { return vertices < 24 ? kCoarseSide : kFineSide; }
// With more cells than this along a side, the gauge is computed only at every other corner.
constexpr uint32_t kMaxGaugedCells = 4;

// Trial points on a ray, relative to the length of the ray within the hull.
constexpr double kShrink[] = {1 - 0x1p-22, 1 - 0x1p-16, 1 - 0x1p-10};
// A portal is as good as a facet if the hull exceeds its plane by less than this, relative to its
// distance, because the bounds between corners are no tighter.
constexpr double kMinGain = 0x1p-8;
// Far more than needed. Observed on 64 to 10000 points of a sphere, even with a gain of 2^-26: one
// step to find a portal, and 5 to 13 to refine it.
constexpr int kMaxSteps = 64;

// Approximate angle between the directions that guess a portal, times the square root of the number
// of points: the spacing of points on a sphere. kMaxTilt limits the angle.
constexpr double kTilt = 4;
constexpr double kMaxTilt = 0.7;

float RoundedUp(double value) {
  const auto rounded = static_cast<float>(value);
  if (!(static_cast<double>(rounded) < value)) return rounded;
  // The next larger positive double has the next bit pattern.
  return rounded > 0 ? std::bit_cast<float>(std::bit_cast<uint32_t>(rounded) + 1)
                     : std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

// A corner of a cell: its direction, and the first corner with the same direction, on another face
// along the edges of the cube.
struct CornerPlace {
  Vector direction;
  uint32_t twin;
};

// Returns the corners of a cube map, by faces, then rows.
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

// Built once; the corners are the same for all hulls.
std::span<const CornerPlace> Corners(uint32_t side) {
  static const auto& fine = *new std::vector<CornerPlace>(CornersOf(kFineSide));
  static const auto& coarse = *new std::vector<CornerPlace>(CornersOf(kCoarseSide));
  return side == kFineSide ? fine : coarse;
}

// Returns true if p is in the tetrahedron of a point o strictly inside a hull and a triangle of a
// facet. Exact.
bool IsInCone(const Vector& o, const Vector& a, const Vector& b, const Vector& c, const Vector& p) {
  return Orient3d(o, a, b, p) >= 0 && Orient3d(o, b, c, p) >= 0 && Orient3d(o, c, a, p) >= 0 &&
         Orient3d(a, b, c, p) <= 0;
}

// Returns true if p is in the tetrahedron of four points. Exact; false for a flat one.
bool IsInTetrahedron(const std::array<Vector, 4>& t, const Vector& p) {
  const int turn = Orient3d(t[0], t[1], t[2], t[3]);
  return turn != 0 && turn * Orient3d(p, t[1], t[2], t[3]) >= 0 &&
         turn * Orient3d(t[0], p, t[2], t[3]) >= 0 && turn * Orient3d(t[0], t[1], p, t[3]) >= 0 &&
         turn * Orient3d(t[0], t[1], t[2], p) >= 0;
}

// Returns 1 over the width of a hull along each axis.
Vector PerWidth(const SupportMap& support) {
  Vector per_width;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector n = Vector::Unit(axis);
    per_width[axis] = 1 / (support.Farthest(n).value + support.Farthest(Vector(-n)).value);
  }
  return per_width;
}

// Casts rays from a point o inside a hull, using only the hull's support points.
class RayCaster {
 public:
  RayCaster(std::span<const Vector> points, const Vector& o, const SupportMap& support,
            const Vector& per_width)
      : points_(points),
        o_(o),
        support_(support),
        tilt_(std::min(kMaxTilt, kTilt / std::sqrt(static_cast<double>(points.size())))),
        per_width_(per_width) {}

  // Returns true if o is in the hull: exactly in a tetrahedron of its points. May return false for
  // a point near the boundary.
  bool IsInside() const {
    const Vector first(1, 0.3, 0.2);
    std::array<Vector, 4> t = {Farthest(first), Farthest(-first), o_, o_};
    t[2] = FartherOf(AnyPerpendicularTo(t[1] - t[0]), t[0]);
    Vector n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double side = n.dot(o_ - t[0]);
    t[3] = side == 0 ? FartherOf(n, t[0]) : Farthest(side > 0 ? n : Vector(-n));
    // Walks through a face that has o beyond it, while one exists.
    for (int step = 0; step < kMaxSteps; ++step) {
      if (IsInTetrahedron(t, o_)) return true;
      double farthest = 0;
      int off = -1;
      Vector outwards = Vector::Zero();
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

  // Returns an almost maximal t such that o + t d, as rounded, is in the hull; 0 if none was found.
  // Requires: o in the hull.
  double Reach(const Vector& d) {
    // Reusing the portal of another ray would make t depend on the order of the calls.
    found_ = false;
    // Rays through corners and edges, common in symmetric hulls, may have no portal of their own.
    // Tries rays slightly to one side or another instead.
    constexpr double kOffAxis = 0x1p-24;
    const Vector along = d.cwiseAbs().maxCoeff() * kOffAxis * Vector(0.7, -0.4, 0.9);
    const Vector across = kOffAxis * d.cross(Vector(0.9, 0.7, 0.4));
    for (const Vector& off : {along, Vector(-along), across, Vector(-across)}) {
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
  // Returns the point farthest along n or against it, choosing the one farther from p.
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

  // Returns true if the ray passes through the portal.
  bool Sees(const PlainVector& d) const {
    return found_ && Turn(p_, q_, d) > 0 && Turn(q_, r_, d) > 0 && Turn(r_, p_, d) > 0;
  }
  PlainVector NormalOfPortal() const { return Cross(q_ - p_, r_ - p_); }

  // Tries the farthest points along three directions around an estimated normal: the normal of an
  // ellipsoid with the hull's widths at the point where the ray leaves it.
  bool GuessPortal(const PlainVector& d) {
    // The widths scale that ellipsoid to a sphere.
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

  // Finds a triangle that the ray passes through: a point p along the ray, and q and r on opposite
  // sides of the plane through p and the ray, moved until their segment passes beyond the ray.
  bool FindPortal(const PlainVector& d) {
    found_ = false;
    LookUp(d, 0, p_);
    PlainVector n = Cross(p_, d);
    if (!(LargestComponent(n) > 0x1p-40 * LargestComponent(p_))) n = AnyPerpendicularTo(d);
    LookUp(-n, 1, q_);
    LookUp(n, 2, r_);
    for (int step = 0; step < kMaxSteps; ++step) {
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

  // Moves the portal outwards until it is approximately a facet.
  bool RefinePortal(const PlainVector& d) {
    for (int step = 0; step < kMaxSteps; ++step) {
      const PlainVector n = NormalOfPortal();
      // Negative while the opposite ray passes through the portal.
      const double height = Dot(n, p_);
      const uint32_t id = support_.Farthest(n).vertex;
      const PlainVector w = From(id);
      const double gain = Dot(n, w) - height;
      if (!(gain > kMinGain * std::abs(height))) return height > 0;
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
  // Sideways extent of the search of GuessPortal.
  const double tilt_;
  const Vector per_width_;
  // The portal: points of the hull and their positions relative to o, counter-clockwise seen from
  // outside.
  bool found_ = false;
  std::array<uint32_t, 3> ids_ = {};
  PlainVector p_;
  PlainVector q_;
  PlainVector r_;
};

}  // namespace

CenterBounds::CenterBounds(std::span<const Vector> points, int dimension, const Vector& center,
                           double max_abs, const SupportMap& support, Making making) {
  if (dimension < 3) return;
  double radius = 0;
  for (const Vector& v : points) radius = std::max(radius, (v - center).cwiseAbs().maxCoeff());
  // Such radii exceed the range of pairs, or are so small relative to the coordinates that rounding
  // matters.
  if (!IsFilterSize(radius)) return;
  if (radius < kCenterMinRadius * max_abs) return;
  side_ = SideFor(points.size());
  half_ = 0.5 * side_;
  unit_ = std::ldexp(1.0, std::ilogb(radius));
  per_unit_ = 1 / unit_;
  map_ = std::make_unique<Map>();
  map_->points = points;
  map_->center = center;
  map_->radius = radius;
  map_->max_abs = max_abs;
  map_->support = &support;
  if (making == Making::kAtFirstUse) {
    for (std::atomic<uint64_t>& cells : map_->awaited)
      cells.store(~uint64_t{0}, std::memory_order_relaxed);
  }
}

void CenterBounds::MakeCell(uint32_t face, uint32_t i, uint32_t j) const {
  const std::lock_guard lock(map_->mutex);
  if (map_->corners.empty()) Begin();
  const uint32_t row = side_ + 1;
  const auto first = static_cast<uint32_t>(CubeCell(face, row, i, j));
  for (const uint32_t corner : {first, first + 1, first + row, first + row + 1}) {
    MakeSupport(corner);
    if (map_->largest_gauge < kInfinity) MakeGauge(corner);
  }
  map_->cells[face].fetch_or(uint64_t{1} << (i * side_ + j), std::memory_order_release);
}

// Allocates the corners and computes the largest gauge: the maximum over the cube's eight corners,
// because the gauge is convex on each face. It stays unknown unless the center is certainly inside.
void CenterBounds::Begin() const {
  map_->corners.resize(corner_count(), {kUnknown, kUnknown});
  map_->per_width = PerWidth(*map_->support);
  RayCaster caster(map_->points, map_->center, *map_->support, map_->per_width);
  if (!caster.IsInside()) return;
  double least = kInfinity;
  for (uint32_t octant = 0; octant < 8; ++octant) {
    const auto sign = [octant](uint32_t axis) { return (octant >> axis & 1) == 0 ? 1.0 : -1.0; };
    least = std::min(least, caster.Reach(Vector(sign(0), sign(1), sign(2))));
    // The center is strictly inside only if it is surrounded, up to rounding.
    if (!(least > 0 && least >= kCenterMinRadius * map_->max_abs)) return;
  }
  map_->largest_gauge = (1 + kCenterMargin) / least;
}

void CenterBounds::MakeSupport(uint32_t corner) const {
  std::vector<Corner>& corners = map_->corners;
  const auto& [n, twin] = Corners(side_)[corner];
  if (std::isnan(corners[twin].support)) {
    const double margin = kCenterMargin * map_->radius;
    const double reach = map_->support->Farthest(n).value - n.dot(map_->center);
    corners[twin].support = RoundedUp((reach + margin) * per_unit_);
  }
  // Other threads may be reading a computed corner with the same direction.
  if (std::isnan(corners[corner].support)) corners[corner].support = corners[twin].support;
}

// Requires: a known largest gauge.
float CenterBounds::MakeGauge(uint32_t corner) const {
  std::vector<Corner>& corners = map_->corners;
  float& gauge = corners[corner].gauge;
  if (!std::isnan(gauge)) return gauge;
  const uint32_t row = side_ + 1;
  if (side_ > kMaxGaugedCells) {
    const uint32_t down = corner / row % row % 2 * row;
    const uint32_t right = corner % row % 2;
    if (down != 0 || right != 0) return gauge = MeanGauge(corner, down, right);
  }
  const auto& [d, twin] = Corners(side_)[corner];
  if (!std::isnan(corners[twin].gauge)) return gauge = corners[twin].gauge;
  RayCaster caster(map_->points, map_->center, *map_->support, map_->per_width);
  const double t = caster.Reach(d);
  // Infinite if no point was found.
  gauge = RoundedUp(std::min((1 + kCenterMargin) / t, map_->largest_gauge) * unit_);
  return corners[twin].gauge = gauge;
}

// Returns the mean over the two or four equidistant neighbors of a corner.
float CenterBounds::MeanGauge(uint32_t corner, uint32_t down, uint32_t right) const {
  const double sum = double{MakeGauge(corner - down - right)} + MakeGauge(corner - down + right) +
                     MakeGauge(corner + down - right) + MakeGauge(corner + down + right);
  return RoundedUp(0.25 * sum);
}

}  // namespace hulld
