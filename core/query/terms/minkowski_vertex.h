#ifndef HULLD_CORE_QUERY_TERMS_MINKOWSKI_VERTEX_H_
#define HULLD_CORE_QUERY_TERMS_MINKOWSKI_VERTEX_H_

#include "core/query/terms/vertex_pair.h"

namespace hulld {

// A corner of a simplex or polytope in A - B: its position w = a - b, and the vertices a and b.
// Position: Vector, PlainVector or IntegerVector.
template <typename Position>
struct MinkowskiVertex {
  Position w;
  VertexPair pair;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_MINKOWSKI_VERTEX_H_
