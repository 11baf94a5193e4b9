#include "tests/bench/queries/fcl_scene.h"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision.h>

#include "tests/bench/queries/fcl_shape.h"

namespace hulld::bench {
namespace {

bool CountPair(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* count) {
  const fcl::CollisionRequestd request(1, false);
  fcl::CollisionResultd result;
  if (fcl::collide(a, b, request, result) > 0) ++*static_cast<size_t*>(count);
  return false;
}

}  // namespace

struct FclScene::Data {
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
  fcl::DynamicAABBTreeCollisionManagerd manager;
};

FclScene::FclScene(const std::deque<Hull>& hulls, const std::vector<size_t>& hull_of)
    : data_(std::make_unique<Data>()) {
  std::vector<std::shared_ptr<fcl::Convexd>> shapes;
  for (const Hull& hull : hulls) shapes.push_back(ToFcl(hull));
  for (const size_t hull : hull_of) {
    data_->objects.push_back(std::make_unique<fcl::CollisionObjectd>(shapes[hull]));
    data_->manager.registerObject(data_->objects.back().get());
  }
  data_->manager.setup();
}

FclScene::~FclScene() = default;

size_t FclScene::CountCollisions(const std::vector<Pose>& poses) {
  for (size_t i = 0; i < poses.size(); ++i) {
    data_->objects[i]->setTransform(ToFcl(poses[i]));
    data_->objects[i]->computeAABB();
  }
  // Every object moved: rebuilding the tree is faster than updating it (manager.update()).
  std::vector<fcl::CollisionObjectd*> objects;
  for (const auto& object : data_->objects) objects.push_back(object.get());
  data_->manager.clear();
  data_->manager.registerObjects(objects);
  data_->manager.setup();
  size_t count = 0;
  data_->manager.collide(&count, CountPair);
  return count;
}

}  // namespace hulld::bench
