#ifndef HULLD_CORE_QUERY_PLACED_LANES_H_
#define HULLD_CORE_QUERY_PLACED_LANES_H_

#include <cstdint>
#include <cstring>

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

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_PLACED_LANES_H_
