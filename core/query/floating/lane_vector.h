#ifndef HULLD_CORE_QUERY_FLOATING_LANE_VECTOR_H_
#define HULLD_CORE_QUERY_FLOATING_LANE_VECTOR_H_

#include <cstdint>
#include <cstring>

#include "core/query/placed/plain_vector.h"

namespace hulld {

// Four doubles, and four integers of the same width, in the registers of the compilation target.
using Lanes = double __attribute__((vector_size(32)));
using LaneIds = int64_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void Load(const double* from, Lanes& lanes) {
  std::memcpy(&lanes, from, sizeof lanes);
}
[[gnu::always_inline]] inline void Broadcast(double value, Lanes& lanes) {
  lanes = Lanes{value, value, value, value};
}
// Sets every lane to the union of the bits of all lanes.
[[gnu::always_inline]] inline void Unite(Lanes& lanes) {
  const Lanes halves = __builtin_shufflevector(lanes, lanes, 2, 3, 0, 1);
  lanes =
      reinterpret_cast<Lanes>(reinterpret_cast<LaneIds>(lanes) | reinterpret_cast<LaneIds>(halves));
  const Lanes turned = __builtin_shufflevector(lanes, lanes, 1, 0, 3, 2);
  lanes =
      reinterpret_cast<Lanes>(reinterpret_cast<LaneIds>(lanes) | reinterpret_cast<LaneIds>(turned));
}

// A vector with each coordinate in all four lanes of a register.
struct LaneVector {
  LaneVector() = default;
  [[gnu::always_inline]] explicit LaneVector(const PlainVector& v) {
    Broadcast(v.x, x);
    Broadcast(v.y, y);
    Broadcast(v.z, z);
  }
  [[gnu::always_inline]] PlainVector plain() const { return {x[0], y[0], z[0]}; }

  Lanes x = {0, 0, 0, 0};
  Lanes y = {0, 0, 0, 0};
  Lanes z = {0, 0, 0, 0};
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_LANE_VECTOR_H_
