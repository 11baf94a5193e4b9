#ifndef HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_
#define HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_

#include <cstdint>
#include <optional>

#include "core/numeric/vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A suggestion left by a query for the next query of the same two hulls at other poses: an axis
// that separated them, or vertex pairs; the hull of their differences contained the origin. It is
// never an answer: the next query proves the suggestion again, or drops it. Not thread-safe.
struct PairCache {
  // World frame, from A toward B.
  std::optional<Vector> axis;
  // 0 or 4.
  uint32_t pair_count = 0;
  VertexPair pairs[4];
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_
