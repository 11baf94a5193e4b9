#include <ccd/ccd.h>

#include "tests/bench/hulls/climbing_hull.h"
#include "tests/bench/queries/peers.h"

namespace hulld::bench {
namespace {

enum class Algorithm { kMpr, kGjk };

struct Libccd {
  using Shape = ClimbingHull<double>;
  struct Placed {
    const Shape* shape;
    Eigen::Matrix3d R;
    Vector t;
    Vector center;
    // Last support point of the query.
    mutable uint32_t last = Shape::kNowhere;
  };

  Algorithm algorithm;

  static void Support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* point) {
    const Placed& placed = *static_cast<const Placed*>(object);
    const Vector n =
        placed.R.transpose() * Vector(direction->v[0], direction->v[1], direction->v[2]);
    const Vector p = placed.R * placed.shape->Farthest(n, placed.last) + placed.t;
    ccdVec3Set(point, p.x(), p.y(), p.z());
  }

  static void Center(const void* object, ccd_vec3_t* point) {
    const Vector& center = static_cast<const Placed*>(object)->center;
    ccdVec3Set(point, center.x(), center.y(), center.z());
  }

  static ccd_t Settings() {
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = Support;
    ccd.support2 = Support;
    ccd.center1 = Center;
    ccd.center2 = Center;
    ccd.max_iterations = 500;
    // Tighter than the default of 1e-4, with which MPR gives wrong answers to about fifty more
    // queries of the accuracy suite.
    ccd.mpr_tolerance = 1e-14;
    ccd.epa_tolerance = 1e-10;
    return ccd;
  }

  std::unique_ptr<Shape> MakeShape(const Hull& hull) { return std::make_unique<Shape>(hull); }

  Placed Place(const Shape& shape, const Pose& X_WA) {
    const Eigen::Matrix3d R = RotationOf(X_WA);
    return {&shape, R, X_WA.t, R * shape.center() + X_WA.t, Shape::kNowhere};
  }

  // Each query is independent.
  static void Forget(const Placed& a, const Placed& b) { a.last = b.last = Shape::kNowhere; }

  Verdict Decide(const Placed& a, const Placed& b) {
    static const ccd_t settings = Settings();
    Forget(a, b);
    const int colliding = algorithm == Algorithm::kMpr ? ccdMPRIntersect(&a, &b, &settings)
                                                       : ccdGJKIntersect(&a, &b, &settings);
    return colliding != 0 ? Verdict::kColliding : Verdict::kApart;
  }

  std::optional<double> Depth(const Placed& a, const Placed& b) {
    static const ccd_t settings = Settings();
    Forget(a, b);
    ccd_real_t depth = 0;
    ccd_vec3_t direction;
    ccd_vec3_t position;
    const int outcome = algorithm == Algorithm::kMpr
                            ? ccdMPRPenetration(&a, &b, &settings, &depth, &direction, &position)
                            : ccdGJKPenetration(&a, &b, &settings, &depth, &direction, &position);
    if (outcome != 0) return std::nullopt;
    return depth;
  }
};

}  // namespace

void AddLibccd(std::vector<std::unique_ptr<QueryMethod>>& methods) {
  methods.push_back(std::make_unique<MethodOf<Libccd>>("libccd MPR", Libccd{Algorithm::kMpr}));
  methods.push_back(std::make_unique<MethodOf<Libccd>>("libccd GJK", Libccd{Algorithm::kGjk}));
}

}  // namespace hulld::bench
