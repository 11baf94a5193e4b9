#ifndef HULLD_TESTS_BENCH_QUERIES_FCL_SCENE_H_
#define HULLD_TESTS_BENCH_QUERIES_FCL_SCENE_H_

#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/terms/pose.h"

namespace hulld::bench {

// A scene in FCL's dynamic tree of bounding boxes. Needs FCL: HULLD_HAVE_FCL.
class FclScene {
 public:
  // Object i is hull hull_of[i].
  FclScene(const std::deque<Hull>& hulls, const std::vector<size_t>& hull_of);
  ~FclScene();

  // Moves every object and counts the colliding pairs. Requires: one pose per object.
  size_t CountCollisions(const std::vector<Pose>& poses);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_FCL_SCENE_H_
