#ifndef HULLD_CORE_QUERY_FLOATING_SMALL_PAIR_H_
#define HULLD_CORE_QUERY_FLOATING_SMALL_PAIR_H_

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "core/base/check.h"
#include "core/query/floating/float_pair.h"
#include "core/query/floating/lane_vector.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A pair of small hulls, the common case in scenes. Offers the search interface of FloatPair with
// all vertices rotated into the pair's frame in advance: directions need no rotation, and a vertex
// of A - B is a difference of two known vertices. The farthest vertex is found without a branch,
// because it is unpredictable.
//
// kMaxVertices: the maximum number of vertices of either hull; more would need separate bounds
// (kSupportErrorFactor). Positions have the same bits as in FloatPair. Everything is inlined, so
// that it is compiled for the registers of the calling search. InRegisters: LaneLookup or
// LanePermutation, to look up positions in registers with the same result; void to load them.
template <uint32_t kMaxVertices, typename InRegisters = void>
class SmallPair {
  static_assert(kMaxVertices == 8 || kMaxVertices == 16);

 public:
  static bool Fits(const FloatPair& pair) {
    const auto fits = [](const QueryHull& hull) {
      const size_t count = hull.blocks().size();
      return count > 0 && count <= kMaxVertices / 4;
    };
    return fits(pair.a().query_hull()) && fits(pair.b().query_hull());
  }

  // Requires: Fits(pair).
  [[gnu::always_inline]] explicit SmallPair(const FloatPair& pair) : size_(pair.size()) {
    HULLD_DCHECK(Fits(pair));
    a_.Fill(pair.a(), PlainVector(0, 0, 0), 1);
    against_b_.Fill(pair.b(), pair.offset(), -1);
  }

  double size() const { return size_; }

  // Returns the farthest vertex: its value is within FloatPair::SupportError of the maximum
  // (kSupportErrorFactor).
  [[gnu::always_inline]] FloatPair::Support Farthest(const PlainVector& n) const {
    const VertexPair place = PlaceAlong(LaneVector(n));
    return {VertexAt(place), Dot(n, Difference(place))};
  }
  // Like Farthest above; also sets w to the vertex.
  [[gnu::always_inline]] FloatPair::Support Farthest(const LaneVector& n, LaneVector& w) const {
    VertexPair place;
    if constexpr (!std::is_void_v<InRegisters>) {
      static_assert(kMaxVertices == 8);
      LaneIds best_a, best_b;
      a_.BestOfAll(n, best_a);
      against_b_.BestOfAll(n, best_b);
      AddUp(InRegisters(best_a), InRegisters(best_b), w);
      place = {PlaceOf(best_a[0]), PlaceOf(best_b[0])};
    } else {
      place = PlaceAlong(n);
      AddUp(Loading{place.a}, Loading{place.b}, w);
    }
    const Lanes value = (n.x * w.x + n.y * w.y) + n.z * w.z;
    return {VertexAt(place), value[0]};
  }

  [[gnu::always_inline]] PlainVector Difference(VertexPair pair) const {
    return {a_.x[pair.a] + against_b_.x[pair.b], a_.y[pair.a] + against_b_.y[pair.b],
            a_.z[pair.a] + against_b_.z[pair.b]};
  }

 private:
  // The low bits of a value, which contain its vertex number.
  static constexpr int64_t kIdMask = kMaxVertices - 1;

  // The interface of LaneLookup, by loads.
  struct Loading {
    [[gnu::always_inline]] void Find(const double* table, Lanes& found) const {
      Broadcast(table[place], found);
    }
    uint32_t place;
  };

  // Sets w to the difference of two looked-up vertices.
  template <typename Lookup>
  [[gnu::always_inline]] void AddUp(const Lookup& of_a, const Lookup& of_b, LaneVector& w) const {
    Lanes x, y, z;
    of_a.Find(a_.x, w.x);
    of_b.Find(against_b_.x, x);
    of_a.Find(a_.y, w.y);
    of_b.Find(against_b_.y, y);
    of_a.Find(a_.z, w.z);
    of_b.Find(against_b_.z, z);
    w.x += x;
    w.y += y;
    w.z += z;
  }

  static uint32_t PlaceOf(int64_t numbered) { return static_cast<uint32_t>(numbered & kIdMask); }

  [[gnu::always_inline]] VertexPair PlaceAlong(const LaneVector& n) const {
    Lanes best_a, best_b;
    a_.Best(n.x, n.y, n.z, best_a);
    against_b_.Best(n.x, n.y, n.z, best_b);
    // Reduces both hulls at once: A in the lower half, B in the upper.
    Lanes best = __builtin_shufflevector(best_a, best_b, 0, 1, 4, 5);
    const Lanes rest = __builtin_shufflevector(best_a, best_b, 2, 3, 6, 7);
    best = best > rest ? best : rest;
    const Lanes turned = __builtin_shufflevector(best, best, 1, 0, 3, 2);
    best = best > turned ? best : turned;
    const LaneIds ids = reinterpret_cast<LaneIds>(best);
    return {PlaceOf(ids[0]), PlaceOf(ids[2])};
  }
  VertexPair VertexAt(VertexPair place) const {
    return {std::min(place.a, a_.last), std::min(place.b, against_b_.last)};
  }

  struct Side {
    // Stores the vertices in the pair's frame, times `sign`; repeats the last one to fill up.
    [[gnu::always_inline]] void Fill(const PlacedHull& placed, const PlainVector& offset,
                                     double sign) {
      const std::span<const SupportBlock> blocks = placed.query_hull().blocks();
      last = placed.query_hull().point_count() - 1;
      const double* const R = placed.R_WH().data();  // column by column
      for (uint32_t block = 0; block < kMaxVertices; block += 4) {
        const SupportBlock& own = blocks[std::min<size_t>(block / 4, blocks.size() - 1)];
        Lanes own_x, own_y, own_z;
        std::memcpy(&own_x, own.x, sizeof own_x);
        std::memcpy(&own_y, own.y, sizeof own_y);
        std::memcpy(&own_z, own.z, sizeof own_z);
        if (block / 4 >= blocks.size()) {
          own_x = __builtin_shufflevector(own_x, own_x, 3, 3, 3, 3);
          own_y = __builtin_shufflevector(own_y, own_y, 3, 3, 3, 3);
          own_z = __builtin_shufflevector(own_z, own_z, 3, 3, 3, 3);
        }
        const auto store = [&](int row, double shift, double* to) __attribute__((always_inline)) {
          const Lanes position =
              sign * (((R[row] * own_x + R[row + 3] * own_y) + R[row + 6] * own_z) + shift);
          std::memcpy(to + block, &position, sizeof position);
        };
        store(0, offset.x, x);
        store(1, offset.y, y);
        store(2, offset.z, z);
      }
    }

    // Computes values along a direction; keeps the largest of every fourth vertex, with the vertex
    // number in the low bits.
    [[gnu::always_inline]] void Best(const Lanes& n_x, const Lanes& n_y, const Lanes& n_z,
                                     Lanes& best) const {
      Number(0, n_x, n_y, n_z, best);
#pragma GCC unroll 4
      for (uint32_t block = 4; block < kMaxVertices; block += 4) {
        Lanes others;
        Number(block, n_x, n_y, n_z, others);
        best = best > others ? best : others;
      }
    }
    // Sets all lanes to the number of the vertex with the largest value.
    [[gnu::always_inline]] void BestOfAll(const LaneVector& n, LaneIds& all) const {
      Lanes best;
      Best(n.x, n.y, n.z, best);
      const Lanes rest = __builtin_shufflevector(best, best, 2, 3, 0, 1);
      best = best > rest ? best : rest;
      const Lanes turned = __builtin_shufflevector(best, best, 1, 0, 3, 2);
      all = reinterpret_cast<LaneIds>(best > turned ? best : turned) & kIdMask;
    }
    [[gnu::always_inline]] void Number(uint32_t first, const Lanes& n_x, const Lanes& n_y,
                                       const Lanes& n_z, Lanes& numbered) const {
      Lanes px, py, pz;
      std::memcpy(&px, x + first, sizeof px);
      std::memcpy(&py, y + first, sizeof py);
      std::memcpy(&pz, z + first, sizeof pz);
      const LaneIds bits = reinterpret_cast<LaneIds>((n_x * px + n_y * py) + n_z * pz);
      const int64_t id = first;
      const LaneIds ids = {id, id + 1, id + 2, id + 3};
      numbered = reinterpret_cast<Lanes>((bits & ~kIdMask) | ids);
    }
    alignas(32) double x[kMaxVertices];
    alignas(32) double y[kMaxVertices];
    alignas(32) double z[kMaxVertices];
    uint32_t last;
  };

  Side a_;
  // The negated vertices of B.
  Side against_b_;
  double size_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_SMALL_PAIR_H_
