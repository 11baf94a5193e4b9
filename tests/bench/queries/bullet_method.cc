#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include "tests/bench/queries/peers.h"

namespace hulld::bench {
namespace {

btVector3 ToBullet(const Vector& v) { return {v.x(), v.y(), v.z()}; }

// Built for double precision, without margin: Bullet's most exact configuration.
struct Bullet {
  using Shape = btConvexHullShape;
  struct Placed {
    const Shape* shape;
    btTransform X;
  };

  std::unique_ptr<Shape> MakeShape(const Hull& hull) {
    auto shape = std::make_unique<Shape>();
    for (const Vector& v : hull.vertices()) shape->addPoint(ToBullet(v), false);
    shape->recalcLocalAabb();
    shape->setMargin(0);
    return shape;
  }

  Placed Place(const Shape& shape, const Pose& X_WA) {
    const Eigen::Matrix3d R = RotationOf(X_WA);
    const btMatrix3x3 basis(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                            R(2, 2));
    return {&shape, btTransform(basis, ToBullet(X_WA.t))};
  }

  // Uses its GJK alone; hulls that it fails to separate count as colliding, as in Bullet's own
  // detector.
  Verdict Decide(const Placed& a, const Placed& b) {
    btGjkEpaSolver2::sResults results;
    const bool apart = btGjkEpaSolver2::Distance(a.shape, a.X, b.shape, b.X,
                                                 b.X.getOrigin() - a.X.getOrigin(), results);
    return apart ? Verdict::kApart : Verdict::kColliding;
  }

  std::optional<double> Depth(const Placed& a, const Placed& b) {
    btGjkEpaSolver2::sResults results;
    if (!btGjkEpaSolver2::Penetration(a.shape, a.X, b.shape, b.X, b.X.getOrigin() - a.X.getOrigin(),
                                      results, false)) {
      return std::nullopt;
    }
    return -results.distance;
  }

  std::optional<double> Distance(const Placed& a, const Placed& b) {
    btGjkEpaSolver2::sResults results;
    if (!btGjkEpaSolver2::Distance(a.shape, a.X, b.shape, b.X, b.X.getOrigin() - a.X.getOrigin(),
                                   results)) {
      return std::nullopt;
    }
    return results.distance;
  }
};

}  // namespace

void AddBullet(std::vector<std::unique_ptr<QueryMethod>>& methods) {
  methods.push_back(std::make_unique<MethodOf<Bullet>>("Bullet", Bullet{}));
}

}  // namespace hulld::bench
