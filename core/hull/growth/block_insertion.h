#ifndef HULLD_CORE_HULL_GROWTH_BLOCK_INSERTION_H_
#define HULLD_CORE_HULL_GROWTH_BLOCK_INSERTION_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/hull/growth/surface.h"
#include "core/hull/growth/vertex_table.h"

namespace hulld {

// The numbers 0 ... n-1 in rounds, each four times the one before, every round spread evenly and
// irregularly over all of them: a biased randomized insertion order without a permutation in
// memory. Source: Amenta, Choi and Rote 2003, Incremental Constructions con BRIO.
class InsertionRounds {
 public:
  explicit InsertionRounds(size_t n);

  int count() const { return count_; }
  int RoundOf(uint32_t i) const;
  // Appends the members of a round. Requires a round other than the last, whose members are most of
  // the numbers: these are better recognized by RoundOf.
  void AppendRound(int round, std::vector<uint32_t>& members) const;

 private:
  // A round is a range of ranks within each group of consecutive numbers.
  static uint32_t FirstRank(int round) { return round == 0 ? 0 : 1u << (2 * (round - 1)); }

  uint32_t n_;
  int count_;
  uint32_t group_mask_;
};

// Adds a block of points to a surface, all but those with the indices `done`, in an order that is
// fast for any input: into conflict lists what the map of directions cannot reject, or, where most
// points are outside, in rounds of growing size sorted along the surface. Stops and returns false
// when should_stop, which may be empty, says so. Uses up to `threads` OpenMP threads for a large
// block; the result does not depend on how many.
bool InsertBlock(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, int threads,
                 const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_BLOCK_INSERTION_H_
