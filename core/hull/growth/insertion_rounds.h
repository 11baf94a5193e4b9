#ifndef HULLD_CORE_HULL_GROWTH_INSERTION_ROUNDS_H_
#define HULLD_CORE_HULL_GROWTH_INSERTION_ROUNDS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"

namespace hulld {

// Divides the numbers 0 ... n-1 into rounds, each four times as large as the previous one and
// spread evenly but irregularly over all numbers: a biased randomized insertion order that stores
// no permutation. Source: Amenta, Choi and Rote 2003, Incremental Constructions con BRIO.
class InsertionRounds {
 public:
  // Requires: n < 2^32.
  explicit InsertionRounds(size_t n);

  int count() const { return count_; }
  int RoundOf(uint32_t i) const;
  // Appends the members of a round. Requires: a round other than the last, which contains most of
  // the numbers; use RoundOf for its members.
  void AppendRound(int round, std::vector<uint32_t>& members) const;

 private:
  // A round is a range of ranks within each group of consecutive numbers.
  static uint32_t FirstRank(int round) { return round == 0 ? 0 : 1u << (2 * (round - 1)); }

  uint32_t n_;
  int count_;
  uint32_t group_mask_;
};

// Adds points to a surface in rounds of growing size, each reduced to the points that the map of
// directions cannot reject and sorted along the surface: the order for blocks with most points
// outside. Returns false, with some of the points added, if the poll stopped; its steps are
// insertions.
bool InsertInRounds(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                    StopPoll& poll);

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_INSERTION_ROUNDS_H_
