#ifndef HULLD_TESTS_BENCH_QUERIES_FCL_SHAPE_H_
#define HULLD_TESTS_BENCH_QUERIES_FCL_SHAPE_H_

#include <fcl/geometry/shape/convex.h>

#include <memory>

#include "core/hull/hull.h"
#include "core/query/terms/pose.h"
#include "tests/bench/queries/peers.h"

namespace hulld::bench {

inline std::shared_ptr<fcl::Convexd> ToFcl(const Hull& hull) {
  auto vertices =
      std::make_shared<std::vector<fcl::Vector3d>>(hull.vertices().begin(), hull.vertices().end());
  auto faces = std::make_shared<std::vector<int>>();
  int count = 0;
  for (size_t i = 0; i < hull.facet_count(); ++i) {
    const auto facet = hull.facet(i);
    faces->push_back(static_cast<int>(facet.size()));
    faces->insert(faces->end(), facet.begin(), facet.end());
    ++count;
    if (hull.dimension() < 3) {
      // The reverse side, so that the surface is closed.
      faces->push_back(static_cast<int>(facet.size()));
      faces->insert(faces->end(), facet.rbegin(), facet.rend());
      ++count;
    }
  }
  return std::make_shared<fcl::Convexd>(std::move(vertices), count, std::move(faces));
}

inline fcl::Transform3d ToFcl(const Pose& X_WA) {
  fcl::Transform3d X = fcl::Transform3d::Identity();
  X.linear() = RotationOf(X_WA);
  X.translation() = X_WA.t;
  return X;
}

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_FCL_SHAPE_H_
