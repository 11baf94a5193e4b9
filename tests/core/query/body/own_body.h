#ifndef HULLD_TESTS_CORE_QUERY_BODY_OWN_BODY_H_
#define HULLD_TESTS_CORE_QUERY_BODY_OWN_BODY_H_

#include <deque>
#include <optional>
#include <vector>

#include "core/query/body/placed_body.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {

inline Pose At(double x, double y, double z) {
  Pose pose;
  pose.t = Vector(x, y, z);
  return pose;
}

// A body that owns its hulls.
struct OwnBody {
  std::deque<Hull> hulls;
  std::deque<QueryHull> query_hulls;
  std::vector<BodyPiece> pieces;
  std::optional<QueryBody> query;

  void Add(const std::vector<Vector>& points, const Pose& X_BP, double radius = 0) {
    hulls.push_back(points.empty() ? Hull() : BuildHull(points));
    query_hulls.emplace_back(hulls.back());
    pieces.push_back({&query_hulls.back(), X_BP, radius});
  }
  void Finish() { query.emplace(pieces); }
  PlacedBody Placed(const Pose& X_WB, double radius = 0) const {
    return PlacedBody(*query, X_WB, radius);
  }
};

// Adds hulls of a few lattice points each, some rotated, some empty.
inline void Fill(Random& random, int pieces, OwnBody* body) {
  for (int i = 0; i < pieces; ++i) {
    Pose pose = At(random.Between(-3, 3), random.Between(-3, 3), random.Between(-3, 3));
    if (i % 2 == 0) pose.q = {1, 1.0 * random.Between(-1, 1), 0, 1.0 * random.Between(-1, 1)};
    const int points = i % 5 == 4 ? 0 : random.Between(1, 5);
    body->Add(RandomLatticePoints(random, points, 3), pose);
  }
  body->Finish();
}

// Adds cubes of side 1 with corners `spacing` apart.
inline void FillGrid(int side, double spacing, OwnBody* body) {
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      for (int z = 0; z < side; ++z) {
        body->Add(LatticeCube(2, 1), At(spacing * x, spacing * y, spacing * z));
      }
    }
  }
  body->Finish();
}

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_QUERY_BODY_OWN_BODY_H_
