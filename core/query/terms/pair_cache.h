#ifndef HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_
#define HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/boxed.h"
#include "core/numeric/vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// The pose of B relative to A, exactly: equal if and only if all numbers are equal, which a common
// translation preserves.
struct RelativePose {
  std::array<double, 4> q_A;
  std::array<double, 4> q_B;
  // t_B - t_A is the exact sum of both.
  std::array<double, 3> offset;
  std::array<double, 3> offset_rest;

  // Converts the pose of B relative to A to the pose of A relative to B.
  void Mirror() {
    std::swap(q_A, q_B);
    for (double& x : offset) x = -x;
    for (double& x : offset_rest) x = -x;
  }
  friend bool operator==(const RelativePose&, const RelativePose&) = default;
};

// A suggestion left by a query for the next query of the same two hulls at other poses: an axis
// that separated them, or vertex pairs; the hull of their differences contained the origin. The
// next query proves the suggestion again, or drops it. For hulls that touched, the cache holds
// their relative pose: the same hulls at the same relative pose touch again. It also holds the axis
// and the pairs of their contact, because hulls that slide along each other often touch in the same
// facets. Not thread-safe.
struct PairCache {
  // World frame, from A toward B.
  std::optional<Vector> axis;
  // 0 or 4; for hulls that touched, 0, or 1 or 3 with an axis.
  uint32_t pair_count = 0;
  VertexPair pairs[4];
  Boxed<RelativePose> touching;

  // Drops everything that is valid only for the same hulls. Call when a hull is replaced; the axis
  // remains a good guess.
  void ForgetHulls() {
    pair_count = 0;
    touching = {};
  }
  void Clear() {
    axis.reset();
    ForgetHulls();
  }
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_PAIR_CACHE_H_
