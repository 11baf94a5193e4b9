#ifndef HULLD_CORE_QUERY_FLOAT_SEARCH_H_
#define HULLD_CORE_QUERY_FLOAT_SEARCH_H_

#include <cstdint>

#include "core/query/float_pair.h"
#include "core/query/portal_search.h"

namespace hulld {

// The portal search in floating point. The search may err; what it claims is certified by proven
// bounds: SEPARATED when the support value is below -SupportError, OVERLAPPING when the origin is
// inside the tetrahedron of the centre and the portal by more than the error of its volumes.
// Everything else stays undecided, touching always.
struct FloatSearchResult {
  // kTouching never.
  PortalResult<Vector> portal;
  uint64_t directions_tried = 0;
};

// Requires pair.usable() and both hulls not empty.
FloatSearchResult SearchInFloatingPoint(const FloatPair& pair);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOAT_SEARCH_H_
