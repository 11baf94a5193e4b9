#ifndef HULLD_CORE_QUERY_TERMS_RUNG_H_
#define HULLD_CORE_QUERY_TERMS_RUNG_H_

#include <array>
#include <cstddef>
#include <cstdint>

namespace hulld {

// The step of the ladder that decided an answer.
enum class Rung : uint8_t {
  kBounds,         // an empty hull, or bounding spheres; for the relation alone, also bounds of the
                   // hulls along the line of their centers
  kCached,         // the axis or the vertex pairs of the previous query of the pair
  kFloatingPoint,  // the hulls, in floating point with a proven error bound
  kExact,          // exact arithmetic
};
inline constexpr size_t kRungCount = 4;

// Number of answers by rung.
struct RungCounts {
  // In the order of Rung.
  std::array<uint64_t, kRungCount> by_rung = {};

  void Add(Rung rung) { ++by_rung[static_cast<size_t>(rung)]; }
  RungCounts& operator+=(const RungCounts& other) {
    for (size_t rung = 0; rung < kRungCount; ++rung) by_rung[rung] += other.by_rung[rung];
    return *this;
  }
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_RUNG_H_
