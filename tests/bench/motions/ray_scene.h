#ifndef HULLD_TESTS_BENCH_MOTIONS_RAY_SCENE_H_
#define HULLD_TESTS_BENCH_MOTIONS_RAY_SCENE_H_

#include <cstdint>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/terms/pose.h"

namespace hulld::bench {

// Rays from `start` to `end`, and hulls at poses.
struct RayScene {
  struct Ray {
    Vector start;
    Vector end;
  };
  struct Target {
    size_t hull;
    Pose X_WH;
  };
  std::vector<Hull> hulls;
  std::vector<Target> targets;
  std::vector<Ray> rays;
};

// Bullet's collision world with a target for each hull, if it was found at build time.
class BulletRays {
 public:
  explicit BulletRays(const RayScene& scene);
  BulletRays(const BulletRays&) = delete;
  BulletRays& operator=(const BulletRays&) = delete;
  ~BulletRays();

  // Casts every ray, on one thread. Returns the number of pairs that hit.
  uint64_t Cast(const std::vector<RayScene::Ray>& rays);

 private:
  struct World;
  World* world_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_MOTIONS_RAY_SCENE_H_
