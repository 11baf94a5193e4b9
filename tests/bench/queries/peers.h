#ifndef HULLD_TESTS_BENCH_QUERIES_PEERS_H_
#define HULLD_TESTS_BENCH_QUERIES_PEERS_H_

#include <memory>
#include <vector>

#include "tests/bench/queries/query_method.h"

namespace hulld::bench {

// Each is linked only if its library was found: HULLD_HAVE_FCL, HULLD_HAVE_CCD, HULLD_HAVE_BULLET.
void AddFcl(std::vector<std::unique_ptr<QueryMethod>>& methods);
void AddLibccd(std::vector<std::unique_ptr<QueryMethod>>& methods);
void AddBullet(std::vector<std::unique_ptr<QueryMethod>>& methods);

// Returns R(q) / |q|^2 as every library computes it, in plain double.
inline Eigen::Matrix3d RotationOf(const Pose& pose) {
  return Eigen::Quaterniond(pose.q[0], pose.q[1], pose.q[2], pose.q[3])
      .normalized()
      .toRotationMatrix();
}

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_PEERS_H_
