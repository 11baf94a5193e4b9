#ifndef HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_
#define HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_

#include <cstdint>
#include <optional>

#include "core/numeric/vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// What a query of one pair leaves for the next one of the same hulls at other poses: an axis that
// separated them, or vertex pairs whose differences surrounded the origin. Never an answer: what it
// suggests is proven anew or dropped. Belongs to one caller at a time.
struct PairCache {
  // World frame, from A towards B.
  std::optional<Vector> axis;
  // 0 or 4.
  uint32_t pair_count = 0;
  VertexPair pairs[4];
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_
