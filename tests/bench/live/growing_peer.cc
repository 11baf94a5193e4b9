#include "tests/bench/live/growing_peer.h"

#ifdef HULLD_HAVE_BULLET
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>
#endif

namespace hulld::bench {

#ifdef HULLD_HAVE_BULLET
namespace {

btVector3 ToBullet(const Vector& v) { return {v.x(), v.y(), v.z()}; }

btTransform ToBullet(const Pose& pose) {
  return btTransform(btQuaternion(pose.q[1], pose.q[2], pose.q[3], pose.q[0]).normalized(),
                     ToBullet(pose.t));
}

// In double precision, without margin.
class BulletHull : public GrowingPeer {
 public:
  explicit BulletHull(std::span<const Vector> points) {
    for (const Vector& p : points) shape_.addPoint(ToBullet(p), false);
    shape_.setMargin(0);
  }

  // Does not update the box, which neither GJK uses.
  void Add(const Vector& point) override { shape_.addPoint(ToBullet(point), false); }

  void UpdateBox() override { shape_.recalcLocalAabb(); }

  bool CollidesBySolver(const GrowingPeer& other, const Pose& X_AB) const override {
    const auto& b = static_cast<const BulletHull&>(other);
    const btTransform X_B = ToBullet(X_AB);
    btGjkEpaSolver2::sResults results;
    return !btGjkEpaSolver2::Distance(&shape_, btTransform::getIdentity(), &b.shape_, X_B,
                                      X_B.getOrigin(), results);
  }

  bool CollidesByDetector(const GrowingPeer& other, const Pose& X_AB) const override {
    const auto& b = static_cast<const BulletHull&>(other);
    btVoronoiSimplexSolver simplex;
    btGjkPairDetector detector(&shape_, &b.shape_, &simplex, nullptr);
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = btTransform::getIdentity();
    input.m_transformB = ToBullet(X_AB);
    btPointCollector collector;
    detector.getClosestPoints(input, collector, nullptr);
    return !(collector.m_hasResult && collector.m_distance > 0);
  }

 private:
  btConvexHullShape shape_;
};

}  // namespace

std::unique_ptr<GrowingPeer> MakeGrowingPeer(std::span<const Vector> points) {
  return std::make_unique<BulletHull>(points);
}
#else
std::unique_ptr<GrowingPeer> MakeGrowingPeer(std::span<const Vector> /*points*/) { return nullptr; }
#endif

}  // namespace hulld::bench
