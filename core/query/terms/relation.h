#ifndef HULLD_CORE_QUERY_TERMS_RELATION_H_
#define HULLD_CORE_QUERY_TERMS_RELATION_H_

#include <cstdint>

namespace hulld {

// The relation of two closed convex sets A and B, over the reals. An empty hull is separated from
// every set.
enum class Relation : uint8_t {
  kSeparated,        // no common point
  kTouching,         // 0 is on the boundary of A - B
  kOverlapping,      // 0 is interior to A - B
  kWithinTolerance,  // |separation| <= QueryOptions::tolerance; collision undecided
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_RELATION_H_
