// A program that uses hulld::core only: two unit cubes that share a face touch.
#include <cstdio>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"

int main() {
  std::vector<hulld::Vector> corners;
  for (int corner = 0; corner < 8; ++corner) {
    corners.emplace_back(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
  }
  hulld::HullBuilder builder;
  if (!builder.Add(corners).ok()) return 1;
  const hulld::Hull cube = builder.Snapshot();
  hulld::Pose X_WB;
  X_WB.t = hulld::Vector(1, 0, 0);
  const auto answer = hulld::CheckCollision(cube, hulld::Pose(), cube, X_WB);
  if (!answer.ok()) return 1;
  const bool touching = answer->relation == hulld::Relation::kTouching;
  std::puts(touching ? "touching" : "not touching");
  return touching ? 0 : 1;
}
