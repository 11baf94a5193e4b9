#ifndef HULLD_CORE_QUERY_FLOATING_PATH_CAST_H_
#define HULLD_CORE_QUERY_FLOATING_PATH_CAST_H_

#include <array>
#include <cstdint>

#include "core/numeric/vector.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/motion.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// The path of the origin relative to C, which is A - B at time 0, in floating point: from the
// origin to `displacement`.
struct RelativePath {
  // Requires: neither hull turns.
  RelativePath(const FloatPair& start, const Motion& X_WA, const Motion& X_WB);

  // The displacement of B relative to A; each component errs by at most 2 u times `length`.
  Vector displacement;
  // The sum of the largest components of both displacements.
  double length;
  // kTranslatedGapErrorFactor times this bounds the error of a gap.
  double size;
};

// The result of a cast. The separation is proven, the rest is a hint.
struct PathCast {
  enum class Outcome : uint8_t { kUndecided, kSeparated, kFacet };

  Outcome outcome = Outcome::kUndecided;
  // The pair is separated along `direction` from time 0 up to and including this time; 0 if no
  // separating plane was found, 1 if kSeparated.
  double separated_until = 0;
  Vector direction = Vector::Zero();
  // kFacet: the vertices of the triangle of C that the path enters first, up to rounding.
  std::array<VertexPair, 3> facet = {};
};

// Casts the path against C. A triangle of points of C that the path's line crosses, a portal, is
// found in the projection along the path, and moved against the path by its support vertex until
// its plane supports C. Every plane on the way is tested for a proven gap. Source: Snethen 2008
// (XenoCollide), with the path as the ray. Requires: start.usable(), and IsFilterSize(path.size).
PathCast CastPath(const FloatPair& start, const RelativePath& path);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_PATH_CAST_H_
