#ifndef HULLD_CORE_QUERY_FLOATING_FACET_ENTRY_H_
#define HULLD_CORE_QUERY_FLOATING_FACET_ENTRY_H_

#include <array>
#include <optional>

#include "core/query/floating/float_pair.h"
#include "core/query/floating/path_cast.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Two adjacent doubles in [0, 1] with a time strictly between them.
struct BetweenTimes {
  double before;
  double after;
};

// Returns the doubles around the time at which the path enters the solid C through the inside of a
// triangle of three of its vertices. Returns nothing unless floating point and double-double
// arithmetic prove that C is solid, the triangle lies in a supporting plane, the line crosses its
// inside, and the time is not a double. Cost: about a microsecond.
std::optional<BetweenTimes> FindEntry(const FloatPair& start, const RelativePath& path,
                                      const Motion& X_WA, const Motion& X_WB,
                                      const std::array<VertexPair, 3>& facet);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_FACET_ENTRY_H_
