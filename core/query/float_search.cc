#include "core/query/float_search.h"

#include <algorithm>
#include <cmath>

#include "core/numeric/error_bounds.h"

namespace hulld {
namespace {

// More directions than this are spent only near contact, where exact signs are needed anyway.
// Observed: random pairs of 10000 vertices, 1e-6 apart, need 18 on average.
constexpr uint64_t kMaxDirections = 64;

struct Corner {
  Vector w;
  VertexPair pair;
};

// The corners of the part of A - B that is nearest to the origin so far: a vertex, an edge, a
// triangle or a tetrahedron. The newest comes last.
class Simplex {
 public:
  uint32_t count() const { return count_; }
  const Corner& corner(uint32_t i) const { return corners_[i]; }

  bool Contains(VertexPair pair) const {
    for (uint32_t i = 0; i < count_; ++i) {
      if (corners_[i].pair == pair) return true;
    }
    return false;
  }

  void Add(const Corner& corner) { corners_[count_++] = corner; }

  // Reduces to the corners of the face nearest to the origin, up to rounding, and gives a direction
  // from that face towards the origin. False when the origin is in the tetrahedron.
  bool Reduce(Vector& n) {
    switch (count_) {
      case 1:
        n = -corners_[0].w;
        return true;
      case 2:
        ReduceEdge(n);
        return true;
      case 3:
        ReduceTriangle(n);
        return true;
      default:
        return ReduceTetrahedron(n);
    }
  }

  // Reduces a tetrahedron that holds the origin to the nearest of its faces, up to rounding; gives
  // the face's normal, outwards.
  Vector ReduceToNearestFace() {
    double nearest = INFINITY;
    uint32_t off_face = 3;
    Vector outwards = Vector::UnitX();
    for (uint32_t i = 0; i < 4; ++i) {
      const Vector& p = corners_[(i + 1) % 4].w;
      Vector n = (corners_[(i + 2) % 4].w - p).cross(corners_[(i + 3) % 4].w - p);
      if (n.dot(corners_[i].w - p) > 0) n = -n;
      const double distance = n.dot(p) / n.norm();
      if (!(distance < nearest)) continue;
      nearest = distance;
      off_face = i;
      outwards = n;
    }
    std::swap(corners_[off_face], corners_[3]);
    count_ = 3;
    return outwards;
  }

  // A point of the simplex near to the origin: the nearest but for rounding once it is reduced.
  // Whatever the rounding, weights are in [0, 1] and it is in the simplex, but for the rounding of
  // the weighted sum.
  Vector NearPoint() const {
    const Vector& p = corners_[count_ - 1].w;
    if (count_ == 1) return p;
    const Vector& q = corners_[count_ - 2].w;
    if (count_ == 2) return p + Weight(-(q - p).dot(p), (q - p).squaredNorm()) * (q - p);
    const Vector& r = corners_[count_ - 3].w;
    const Vector normal = (q - p).cross(r - p);
    // The origin's coordinates in the triangle, by areas; for a tetrahedron that of its last face.
    const double area = normal.squaredNorm();
    const double along_q = Weight(-(r - p).cross(normal).dot(p), area);
    const double along_r = Weight(-normal.cross(q - p).dot(p), area);
    const double sum = std::max(1.0, along_q + along_r);
    return p + (along_q / sum) * (q - p) + (along_r / sum) * (r - p);
  }

 private:
  static double Weight(double part, double whole) {
    return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0;
  }
  void Keep(const Corner& p) {
    corners_[0] = p;
    count_ = 1;
  }
  void Keep(const Corner& q, const Corner& p) {
    const Corner kept[2] = {q, p};
    std::copy(kept, kept + 2, corners_.begin());
    count_ = 2;
  }
  void Keep(const Corner& r, const Corner& q, const Corner& p) {
    const Corner kept[3] = {r, q, p};
    std::copy(kept, kept + 3, corners_.begin());
    count_ = 3;
  }

  // From the edge's line towards the origin.
  static Vector AcrossEdge(const Vector& p, const Vector& e) {
    return e * (e.dot(p) / e.squaredNorm()) - p;
  }

  void ReduceEdge(Vector& n) {
    const Corner& p = corners_[1];
    const Vector e = corners_[0].w - p.w;
    if (e.dot(p.w) < 0) {
      n = AcrossEdge(p.w, e);
    } else {
      n = -p.w;
      Keep(p);
    }
  }

  // Which part of the triangle of the newest corner p and of q and r is nearest; the edge q r and
  // its ends are not, as p was farther towards the origin than these.
  enum class Part { kCorner, kEdgeToQ, kEdgeToR, kInside };
  static Part NearestPart(const Vector& p, const Vector& q, const Vector& r, Vector& n) {
    const Vector e = q - p;
    const Vector f = r - p;
    const double along_e = -e.dot(p);
    const double along_f = -f.dot(p);
    if (along_e <= 0 && along_f <= 0) {
      n = -p;
      return Part::kCorner;
    }
    const Vector normal = e.cross(f);
    if (along_e > 0 && e.cross(normal).dot(p) < 0) {
      n = AcrossEdge(p, e);
      return Part::kEdgeToQ;
    }
    if (along_f > 0 && normal.cross(f).dot(p) < 0) {
      n = AcrossEdge(p, f);
      return Part::kEdgeToR;
    }
    n = normal.dot(p) > 0 ? Vector(-normal) : normal;
    return Part::kInside;
  }

  void KeepPart(Part part, const Corner& p, const Corner& q, const Corner& r) {
    switch (part) {
      case Part::kCorner:
        return Keep(p);
      case Part::kEdgeToQ:
        return Keep(q, p);
      case Part::kEdgeToR:
        return Keep(r, p);
      case Part::kInside:
        return Keep(r, q, p);
    }
  }

  void ReduceTriangle(Vector& n) {
    const Corner p = corners_[2];
    KeepPart(NearestPart(p.w, corners_[1].w, corners_[0].w, n), p, Corner(corners_[1]),
             Corner(corners_[0]));
  }

  // Squared distance from the origin along n, which leads there from the part that holds p.
  static double SquaredDistance(const Vector& n, const Vector& p) {
    const double along = n.dot(p);
    return along * along / n.squaredNorm();
  }

  bool ReduceTetrahedron(Vector& n) {
    const Corner p = corners_[3];
    const Corner others[3] = {corners_[2], corners_[1], corners_[0]};
    const Vector edges[3] = {others[0].w - p.w, others[1].w - p.w, others[2].w - p.w};
    const Vector normals[3] = {edges[0].cross(edges[1]), edges[1].cross(edges[2]),
                               edges[2].cross(edges[0])};
    const double turn = normals[0].dot(edges[2]) > 0 ? -1 : 1;
    double nearest = INFINITY;
    int face = -1;
    Part part = Part::kInside;
    for (int i = 0; i < 3; ++i) {
      // The origin is beyond the face.
      if (!(turn * normals[i].dot(p.w) < 0)) continue;
      Vector towards;
      const Part candidate = NearestPart(p.w, others[i].w, others[(i + 1) % 3].w, towards);
      const double distance = SquaredDistance(towards, p.w);
      if (!(distance < nearest)) continue;
      nearest = distance;
      face = i;
      part = candidate;
      n = towards;
    }
    if (face < 0) return false;
    KeepPart(part, p, others[face], others[(face + 1) % 3]);
    return true;
  }

  std::array<Corner, 4> corners_;
  uint32_t count_ = 0;
};

double Volume(const Vector& u, const Vector& v, const Vector& w) { return u.dot(v.cross(w)); }

// Whether the origin is certain to be strictly inside a tetrahedron of computed Minkowski vertices.
bool HoldsOrigin(const FloatPair& pair, const Vector& p, const Vector& q, const Vector& r,
                 const Vector& s) {
  const double largest =
      p.cwiseAbs().cwiseMax(q.cwiseAbs()).cwiseMax(r.cwiseAbs()).cwiseMax(s.cwiseAbs()).maxCoeff();
  const double position_error = kMinkowskiErrorFactor * pair.size();
  const double bound = kTetrahedronErrorFactor * largest * largest * position_error;
  // The origin's barycentric coordinates, up to a common factor whose sign is that of the first.
  const double first = Volume(p, q, r);
  const double turn = first > 0 ? 1 : -1;
  return turn * first > bound && turn * Volume(s, r, q) > bound && turn * Volume(s, p, r) > bound &&
         turn * Volume(s, q, p) > bound;
}

class FloatSearch {
 public:
  FloatSearch(const FloatPair& pair, double tolerance) : pair_(pair), tolerance_(tolerance) {}

  FloatSearchResult Run() {
    Vector n = -pair_.CenterDifference();
    if (IsZero(n)) n = Vector::UnitX();
    while (result_.directions_tried < kMaxDirections && Explore(n)) {
    }
    if (result_.verdict != FloatVerdict::kSeparated) {
      result_.pair_count = simplex_.count();
      for (uint32_t i = 0; i < simplex_.count(); ++i) result_.pairs[i] = simplex_.corner(i).pair;
    }
    return result_;
  }

 private:
  // Explores along n and gives the next direction; false when the search is over.
  bool Explore(Vector& n) {
    double largest = n.cwiseAbs().maxCoeff();
    if (!(largest >= kDirectionMin && largest <= kDirectionMax)) {
      if (!(largest > 0)) return false;
      n /= std::ldexp(1.0, std::ilogb(largest));
      largest = n.cwiseAbs().maxCoeff();
    }
    ++result_.directions_tried;
    FloatPair::Support farthest = pair_.Farthest(n);
    const double error = kSupportErrorFactor * largest * pair_.size();
    if (farthest.value < -error) {
      if (!farthest.certain) farthest = pair_.CertainFarthest(n);
      if (farthest.value < -error) return EndSeparated(n);
    }
    const Vector along = n;
    // Else nothing is farther towards the origin.
    const bool progress = !simplex_.Contains(farthest.pair);
    bool outside = true;
    if (progress) {
      simplex_.Add({pair_.Difference(farthest.pair), farthest.pair});
      outside = simplex_.Reduce(n);
    }
    if (tolerance_ > 0 && IsWithinTolerance(along, farthest, error)) {
      result_.verdict = FloatVerdict::kWithinTolerance;
      return false;
    }
    if (outside) return progress;
    if (HoldsOrigin(pair_, simplex_.corner(0).w, simplex_.corner(1).w, simplex_.corner(2).w,
                    simplex_.corner(3).w)) {
      result_.verdict = FloatVerdict::kOverlapping;
      return false;
    }
    if (tolerance_ == 0) return false;
    // Near the boundary of A - B: on through the nearest face, to see how far it reaches there.
    n = simplex_.ReduceToNearestFace();
    return true;
  }

  bool EndSeparated(const Vector& n) {
    result_.verdict = FloatVerdict::kSeparated;
    result_.axis = n;
    return false;
  }

  // Whether |separation| <= tolerance is certain: A - B has a point so near to the origin, and
  // along some direction does not reach farther than that beyond it. `farthest` is that along n.
  bool IsWithinTolerance(const Vector& n, FloatPair::Support farthest, double error) {
    const double length = n.norm();
    if (farthest.value < tolerance_ * length) {
      if (!farthest.certain) farthest = pair_.CertainFarthest(n);
      reach_ = std::min(reach_, std::max(0.0, farthest.value + error) / length);
    }
    nearest_ = std::min(nearest_, simplex_.NearPoint().norm());
    const double distance = nearest_ + kNearPointErrorFactor * pair_.size();
    return std::max(reach_, distance) * kSphereSquareRoundUp <= tolerance_;
  }

  const FloatPair& pair_;
  const double tolerance_;
  Simplex simplex_;
  // With a tolerance: the least reach of A - B beyond the origin along some direction, and the
  // least distance of some point of it, so far.
  double reach_ = INFINITY;
  double nearest_ = INFINITY;
  FloatSearchResult result_;
};

}  // namespace

FloatSearchResult SearchInFloatingPoint(const FloatPair& pair, double tolerance) {
  return FloatSearch(pair, tolerance).Run();
}

FloatSearchResult TryCached(const FloatPair& pair, const PairCache& cache) {
  FloatSearchResult result;
  if (cache.axis.has_value()) {
    const Vector& n = *cache.axis;
    ++result.directions_tried;
    const double error = pair.SupportError(n);
    FloatPair::Support farthest = pair.Farthest(n);
    if (farthest.value < -error && !farthest.certain) farthest = pair.CertainFarthest(n);
    if (farthest.value < -error) {
      result.verdict = FloatVerdict::kSeparated;
      result.axis = n;
    }
  } else if (cache.pair_count == 4) {
    const auto difference = [&](int i) { return pair.Difference(cache.pairs[i]); };
    if (HoldsOrigin(pair, difference(0), difference(1), difference(2), difference(3))) {
      result.verdict = FloatVerdict::kOverlapping;
      result.pair_count = 4;
      std::copy(cache.pairs, cache.pairs + 4, result.pairs.begin());
    }
  }
  return result;
}

}  // namespace hulld
