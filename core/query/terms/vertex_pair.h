#ifndef HULLD_CORE_QUERY_TERMS_VERTEX_PAIR_H_
#define HULLD_CORE_QUERY_TERMS_VERTEX_PAIR_H_

#include <cstdint>

namespace hulld {

// A vertex of A and a vertex of B, by index into Hull::vertices(). Represents the point a - b of A
// - B.
struct VertexPair {
  uint32_t a;
  uint32_t b;
  friend bool operator==(const VertexPair&, const VertexPair&) = default;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_VERTEX_PAIR_H_
