// Uncertified methods, for comparison.

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "core/query/placed/placed_hull.h"
#include "tests/bench/hulls/climbing_hull.h"
#include "tests/bench/queries/peers.h"
#include "tests/bench/queries/query_method.h"

namespace hulld::bench {
namespace {

struct Interval {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

Interval Project(const std::vector<Vector>& points, const Vector& n) {
  Interval result;
  for (const Vector& p : points) {
    const double value = n.dot(p);
    result.low = std::min(result.low, value);
    result.high = std::max(result.high, value);
  }
  return result;
}

struct TextbookInDouble {
  struct Shape {
    const Hull* hull;
    std::vector<Vector> points;
    std::vector<Vector> normals;
  };
  struct Placed {
    const Shape* shape;
    std::vector<Vector> points;
    std::vector<Vector> normals;
    std::vector<Vector> edges;
  };

  double perturbation;
  std::mt19937_64 engine{20261121};

  std::unique_ptr<Shape> MakeShape(const Hull& hull) {
    auto shape = std::make_unique<Shape>();
    shape->hull = &hull;
    std::uniform_real_distribution<double> noise(-perturbation, perturbation);
    for (Vector p : hull.vertices()) {
      if (perturbation > 0) {
        for (int k = 0; k < 3; ++k) p[k] += noise(engine) * hull.max_abs_coordinate();
      }
      shape->points.push_back(p);
    }
    for (size_t i = 0; i < hull.facet_count(); ++i) {
      const auto facet = hull.facet(i);
      const Vector& origin = shape->points[facet[0]];
      shape->normals.push_back(
          (shape->points[facet[1]] - origin).cross(shape->points[facet[2]] - origin).normalized());
    }
    return shape;
  }

  Placed Place(const Shape& shape, const Pose& X_WA) {
    const Eigen::Matrix3d R = RotationOf(X_WA);
    Placed placed{&shape, {}, {}, {}};
    for (const Vector& p : shape.points) placed.points.push_back(R * p + X_WA.t);
    for (const Vector& n : shape.normals) placed.normals.push_back(R * n);
    for (const Edge& edge : shape.hull->edges()) {
      placed.edges.push_back(placed.points[edge.head] - placed.points[edge.tail]);
    }
    return placed;
  }

  // Calls test(n) for each axis until it returns false.
  template <typename Test>
  static void VisitAxes(const Placed& a, const Placed& b, Test test) {
    for (const Vector& n : a.normals) {
      if (!test(n)) return;
    }
    for (const Vector& n : b.normals) {
      if (!test(n)) return;
    }
    for (const Vector& edge_a : a.edges) {
      for (const Vector& edge_b : b.edges) {
        const Vector n = edge_a.cross(edge_b);
        // Parallel edges.
        if (n.squaredNorm() < 1e-20 * edge_a.squaredNorm() * edge_b.squaredNorm()) continue;
        if (!test(n)) return;
      }
    }
  }

  Verdict Decide(const Placed& a, const Placed& b) {
    Verdict verdict = Verdict::kColliding;
    VisitAxes(a, b, [&](const Vector& n) {
      const Interval on_a = Project(a.points, n);
      const Interval on_b = Project(b.points, n);
      if (on_a.high >= on_b.low && on_b.high >= on_a.low) return true;
      verdict = Verdict::kApart;
      return false;
    });
    return verdict;
  }

  std::optional<double> Depth(const Placed& a, const Placed& b) {
    double depth = std::numeric_limits<double>::infinity();
    VisitAxes(a, b, [&](const Vector& n) {
      const Vector unit = n.normalized();
      const Interval on_a = Project(a.points, unit);
      const Interval on_b = Project(b.points, unit);
      depth = std::min({depth, on_a.high - on_b.low, on_b.high - on_a.low});
      return depth >= 0;
    });
    if (depth < 0) return std::nullopt;
    return depth;
  }
};

// Source of support points for the plain GJK: hulld's lookup, without the proof that it found the
// farthest.
class LookedUp {
 public:
  using Scalar = double;
  explicit LookedUp(const Hull& hull) : query_hull_(hull) {}
  const Vector& center() const { return query_hull_.hull().center(); }
  const Vector& Farthest(const Vector& n, uint32_t& /*from*/) const {
    return query_hull_.hull().vertices()[query_hull_.Farthest(n).vertex];
  }

 private:
  QueryHull query_hull_;
};

class InFloat : public ClimbingHull<float> {
 public:
  using Scalar = float;
  using ClimbingHull<float>::ClimbingHull;
};

// GJK to the sign: a simplex of A - B moves toward the origin until a support plane misses it or
// four points surround it. Source: van den Bergen 2003, Collision Detection in Interactive 3D
// Environments; the case analysis is that of Muratori 2006.
template <typename Support>
struct PlainGjk {
  using Scalar = typename Support::Scalar;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Shape = Support;
  struct Placed {
    const Shape* shape;
    Eigen::Matrix<Scalar, 3, 3> R;
    Vector t;
  };

  std::unique_ptr<Shape> MakeShape(const Hull& hull) { return std::make_unique<Shape>(hull); }
  Placed Place(const Shape& shape, const Pose& X_WA) {
    return {&shape, RotationOf(X_WA).cast<Scalar>(), X_WA.t};
  }

  // In order of age, newest last.
  struct Simplex {
    std::array<Vector3, 4> points;
    int count = 0;
    void Set(std::initializer_list<Vector3> list) {
      count = 0;
      for (const Vector3& p : list) points[count++] = p;
    }
  };

  static Verdict Decide(const Placed& a, const Placed& b) {
    constexpr int kMaxSteps = 64;
    const Vector3 offset = (b.t - a.t).template cast<Scalar>();
    uint32_t last_a = ClimbingHull<Scalar>::kNowhere;
    uint32_t last_b = ClimbingHull<Scalar>::kNowhere;
    const auto difference = [&](const Vector3& n) -> Vector3 {
      return a.R * a.shape->Farthest(a.R.transpose() * n, last_a) -
             (b.R * b.shape->Farthest(-(b.R.transpose() * n), last_b) + offset);
    };
    Vector3 n = -(a.R * a.shape->center() - (b.R * b.shape->center() + offset));
    if (n.squaredNorm() == 0) n = Vector3::UnitX();
    Simplex simplex;
    for (int step = 0; step < kMaxSteps; ++step) {
      const Vector3 p = difference(n);
      if (n.dot(p) < 0) return Verdict::kApart;
      simplex.points[simplex.count++] = p;
      if (Surrounds(simplex, n)) return Verdict::kColliding;
      if (n.squaredNorm() == 0) return Verdict::kColliding;
    }
    // It cycles near the boundary, so the result is a guess.
    return Verdict::kColliding;
  }

  // Returns true if four points surround the origin. Otherwise drops the points irrelevant to the
  // origin and turns n toward it.
  static bool Surrounds(Simplex& simplex, Vector3& n) {
    switch (simplex.count) {
      case 1:
        n = -simplex.points[0];
        return false;
      case 2:
        OfSegment(simplex, simplex.points[1], simplex.points[0], n);
        return false;
      case 3:
        OfTriangle(simplex, simplex.points[2], simplex.points[1], simplex.points[0], n);
        return false;
      default:
        return OfTetrahedron(simplex, n);
    }
  }

  static void OfSegment(Simplex& simplex, Vector3 newest, Vector3 other, Vector3& n) {
    const Vector3 along = other - newest;
    if (along.dot(-newest) > 0) {
      simplex.Set({other, newest});
      n = along.cross(-newest).cross(along);
    } else {
      simplex.Set({newest});
      n = -newest;
    }
  }

  static void OfTriangle(Simplex& simplex, Vector3 newest, Vector3 p, Vector3 q, Vector3& n) {
    const Vector3 to_p = p - newest;
    const Vector3 to_q = q - newest;
    const Vector3 normal = to_p.cross(to_q);
    if (normal.cross(to_q).dot(-newest) > 0) return OfSegment(simplex, newest, q, n);
    if (to_p.cross(normal).dot(-newest) > 0) return OfSegment(simplex, newest, p, n);
    if (normal.dot(-newest) > 0) {
      simplex.Set({q, p, newest});
      n = normal;
    } else {
      simplex.Set({p, q, newest});
      n = -normal;
    }
  }

  static bool OfTetrahedron(Simplex& simplex, Vector3& n) {
    const auto [r, q, p, newest] = simplex.points;
    const std::array<std::pair<Vector3, Vector3>, 3> faces = {std::pair{p, q}, std::pair{q, r},
                                                              std::pair{r, p}};
    for (const auto& [u, v] : faces) {
      if ((u - newest).cross(v - newest).dot(-newest) > 0) {
        OfTriangle(simplex, newest, u, v, n);
        return false;
      }
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<QueryMethod> MakeTextbookInDouble(double perturbation) {
  return std::make_unique<MethodOf<TextbookInDouble>>(
      perturbation == 0 ? "SAT double" : "SAT perturbed", TextbookInDouble{perturbation});
}

std::unique_ptr<QueryMethod> MakePlainGjkInDouble() {
  return std::make_unique<MethodOf<PlainGjk<LookedUp>>>("GJK double", PlainGjk<LookedUp>{});
}

std::unique_ptr<QueryMethod> MakePlainGjkInFloat() {
  return std::make_unique<MethodOf<PlainGjk<InFloat>>>("GJK float", PlainGjk<InFloat>{});
}

}  // namespace hulld::bench
