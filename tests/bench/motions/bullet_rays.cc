#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <memory>

#include "tests/bench/motions/ray_scene.h"
#include "tests/bench/queries/peers.h"

namespace hulld::bench {
namespace {

btVector3 PointOf(const Vector& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

struct BulletRays::World {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btCollisionWorld collision{&dispatcher, &broadphase, &configuration};
  std::vector<std::unique_ptr<btConvexHullShape>> shapes;
  std::vector<std::unique_ptr<btCollisionObject>> objects;
};

BulletRays::BulletRays(const RayScene& scene) : world_(new World) {
  for (const Hull& hull : scene.hulls) {
    auto shape = std::make_unique<btConvexHullShape>();
    for (const Vector& v : hull.vertices()) shape->addPoint(PointOf(v), false);
    shape->recalcLocalAabb();
    shape->setMargin(0);
    world_->shapes.push_back(std::move(shape));
  }
  for (const RayScene::Target& target : scene.targets) {
    const Eigen::Matrix3d R = RotationOf(target.X_WH);
    const btMatrix3x3 basis(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                            R(2, 2));
    auto object = std::make_unique<btCollisionObject>();
    object->setCollisionShape(world_->shapes[target.hull].get());
    object->setWorldTransform(btTransform(basis, PointOf(target.X_WH.t)));
    world_->collision.addCollisionObject(object.get());
    world_->objects.push_back(std::move(object));
  }
  world_->broadphase.optimize();
}

BulletRays::~BulletRays() {
  for (const auto& object : world_->objects) world_->collision.removeCollisionObject(object.get());
  delete world_;
}

uint64_t BulletRays::Cast(const std::vector<RayScene::Ray>& rays) {
  uint64_t hits = 0;
  for (const RayScene::Ray& ray : rays) {
    const btVector3 start = PointOf(ray.start);
    const btVector3 end = PointOf(ray.end);
    btCollisionWorld::AllHitsRayResultCallback result(start, end);
    world_->collision.rayTest(start, end, result);
    hits += result.m_collisionObjects.size();
  }
  return hits;
}

}  // namespace hulld::bench
