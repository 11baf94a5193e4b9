#ifndef HULLD_CORE_QUERY_FLOATING_LANE_VECTOR_H_
#define HULLD_CORE_QUERY_FLOATING_LANE_VECTOR_H_

#include <cstdint>
#include <cstring>

#include "core/query/placed/lanes.h"
#include "core/query/placed/plain_vector.h"

namespace hulld {

// Sets every lane to the union of the bits of all lanes.
[[gnu::always_inline]] inline void Unite(Lanes& lanes) {
  const Lanes halves = __builtin_shufflevector(lanes, lanes, 2, 3, 0, 1);
  lanes =
      reinterpret_cast<Lanes>(reinterpret_cast<LaneIds>(lanes) | reinterpret_cast<LaneIds>(halves));
  const Lanes turned = __builtin_shufflevector(lanes, lanes, 1, 0, 3, 2);
  lanes =
      reinterpret_cast<Lanes>(reinterpret_cast<LaneIds>(lanes) | reinterpret_cast<LaneIds>(turned));
}

// A look-up of one of eight doubles that stays in vector registers: a load would wait for its index
// to leave them. Only GCC has shuffles by variable indices; without AVX2 they are slow.
#if defined(__GNUC__) && !defined(__clang__)
#define HULLD_HAS_LANE_LOOKUP
class LaneLookup {
 public:
  // index: the same number below 8 in all lanes.
  [[gnu::always_inline]] explicit LaneLookup(const LaneIds& index) {
    const Halves once = reinterpret_cast<Halves>(index);
    const Halves twice = __builtin_shufflevector(once, once, 0, 0, 2, 2, 4, 4, 6, 6);
    halves_ = (twice + twice) | Halves{0, 1, 0, 1, 0, 1, 0, 1};
    // The sign shows if the index is at least 4.
    upper_ = index << 61;
  }
  // Sets every lane to the double.
  [[gnu::always_inline]] void Find(const double* table, Lanes& found) const {
    Halves low, high;
    std::memcpy(&low, table, sizeof low);
    std::memcpy(&high, table + 4, sizeof high);
    low = __builtin_shuffle(low, halves_);
    high = __builtin_shuffle(high, halves_);
    const LaneIds zero = {0, 0, 0, 0};
    found = upper_ < zero ? reinterpret_cast<Lanes>(high) : reinterpret_cast<Lanes>(low);
  }

 private:
  using Halves = int32_t __attribute__((vector_size(32)));
  Halves halves_;
  LaneIds upper_;
};

// A LaneLookup by one permutation of two registers. Requires AVX-512VL.
class LanePermutation {
 public:
  [[gnu::always_inline]] explicit LanePermutation(const LaneIds& index) : index_(index) {}
  [[gnu::always_inline]] void Find(const double* table, Lanes& found) const {
    Lanes low, high;
    Load(table, low);
    Load(table + 4, high);
    found = __builtin_shuffle(low, high, index_);
  }

 private:
  LaneIds index_;
};
#endif

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
