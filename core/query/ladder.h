#ifndef HULLD_CORE_QUERY_LADDER_H_
#define HULLD_CORE_QUERY_LADDER_H_

#include <absl/status/status.h>

#include <array>
#include <cstdint>
#include <functional>
#include <variant>

#include "core/numeric/integer.h"
#include "core/numeric/vector.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/rung.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A relation and, where it is to be evidence, what showed it.
struct Decision {
  // Not defaulted: a compiler then clears the room for every kind of axis, half a kilobyte.
  Decision() {}  // NOLINT

  Relation relation = Relation::kSeparated;
  Rung rung = Rung::kBounds;
  // Separated: n.(a - b) < 0 throughout; touching: <= 0; exactly, as it stands.
  std::variant<std::monostate, Vector, IntegerVector> axis;
  // Overlapping: none, or four pairs whose differences hold 0 strictly inside their hull. Touching:
  // none, or three whose differences hold 0 in their hull, repetitions included.
  uint32_t pair_count = 0;
  std::array<VertexPair, 4> pairs = {};
  uint64_t directions_tried = 0;
};

// What a decision is for.
enum class Purpose {
  kRelation,
  kEvidence,  // also the axis and the pairs that the search found
};

// The ladder. Each rung answers only what its own error bound proves: spheres round the hulls; what
// the cache suggests; for the relation alone, how far the hulls reach along the line of their
// centres; the hulls in floating point; exact arithmetic. Fills `decision`, which must be as
// constructed. Requires tolerance >= 0. Updates the cache, which may be null and otherwise belongs
// to these two hulls. CANCELLED when should_stop, which may be empty, said so; only the exact rung
// asks it.
absl::Status Decide(const FloatPair& pair, double tolerance, PairCache* cache, Purpose purpose,
                    const std::function<bool()>& should_stop, Decision& decision);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_LADDER_H_
