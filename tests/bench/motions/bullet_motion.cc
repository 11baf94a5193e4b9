#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btContinuousConvexCollision.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btSubSimplexConvexCast.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include "tests/bench/motions/motion_methods.h"
#include "tests/bench/queries/peers.h"

namespace hulld::bench {
namespace {

struct Continuous {
  Continuous(const btConvexShape* a, const btConvexShape* b) : cast(a, b, &simplex, &depth) {}
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver depth;
  btContinuousConvexCollision cast;
};

struct Cast {
  Cast(const btConvexShape* a, const btConvexShape* b) : cast(a, b, &simplex) {}
  btVoronoiSimplexSolver simplex;
  btSubsimplexConvexCast cast;
};

// Method: one of the above. Lengths are multiplied by `scale`.
template <typename Method>
class BulletMotion final : public MotionMethod {
 public:
  BulletMotion(std::string name, double scale)
      : MotionMethod(std::move(name), Path::kSteady), scale_(scale) {}

  void Prepare(const MotionSet& set) override {
    set_ = &set;
    shapes_.clear();
    ends_.clear();
    for (const Hull& hull : set.hulls->hulls) {
      auto shape = std::make_unique<btConvexHullShape>();
      for (const Vector& v : hull.vertices()) shape->addPoint(ToBullet(v), false);
      shape->recalcLocalAabb();
      shape->setMargin(0);
      shapes_.push_back(std::move(shape));
    }
    for (const MotionSet::Query& query : set.queries) {
      ends_.push_back({ToBullet(query.X_WA), ToBullet(query.X_WB.start), ToBullet(query.X_WB.end)});
    }
  }

  Impact Find(size_t query) override {
    const MotionSet::Query& pair = set_->queries[query];
    const Ends& ends = ends_[query];
    Method method(shapes_[pair.hull_a].get(), shapes_[pair.hull_b].get());
    btConvexCast::CastResult result;
    if (!method.cast.calcTimeOfImpact(ends.a, ends.a, ends.start, ends.end, result)) return {};
    return {Impact::Verdict::kMeets, result.m_fraction};
  }

 private:
  struct Ends {
    btTransform a;
    btTransform start;
    btTransform end;
  };

  btVector3 ToBullet(const Vector& v) const {
    return {scale_ * v.x(), scale_ * v.y(), scale_ * v.z()};
  }
  btTransform ToBullet(const Pose& X_WA) const {
    const Eigen::Matrix3d R = RotationOf(X_WA);
    const btMatrix3x3 basis(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                            R(2, 2));
    return btTransform(basis, ToBullet(X_WA.t));
  }

  double scale_;
  const MotionSet* set_ = nullptr;
  std::vector<std::unique_ptr<btConvexHullShape>> shapes_;
  std::vector<Ends> ends_;
};

}  // namespace

void AddBulletMotions(bool turns, std::vector<std::unique_ptr<MotionMethod>>& methods) {
  methods.push_back(std::make_unique<BulletMotion<Continuous>>("Bullet", 1));
  methods.push_back(std::make_unique<BulletMotion<Continuous>>("Bullet scaled", 1000));
  if (!turns) methods.push_back(std::make_unique<BulletMotion<Cast>>("Bullet cast", 1));
}

}  // namespace hulld::bench
