#ifndef HULLD_CORE_QUERY_COLLISION_H_
#define HULLD_CORE_QUERY_COLLISION_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/hull/hull.h"
#include "core/query/pose.h"

namespace hulld {

// The relation of two closed convex sets A and B, over the reals. An empty hull is separated from
// all.
enum class Relation {
  kSeparated,    // no common point
  kTouching,     // 0 is on the boundary of A - B
  kOverlapping,  // 0 is interior to A - B
};

enum class AxisKind {
  kFacetA,    // normal of a facet of A
  kFacetB,    // normal of a facet of B
  kEdgeEdge,  // cross product of an edge of A and an edge of B
  kFlat,      // a direction that only flat Minkowski differences need
  kGeneral,   // a support direction found by search
};

enum class Method { kCertifiedSearch, kTextbookSat };

// What decided an answer.
enum class Rung { kFloatingPoint, kExact };

// The vertices of one hull that lie farthest along an axis.
struct Feature {
  std::vector<uint32_t> vertices;  // indices into Hull::vertices(), ascending
  std::optional<uint32_t> facet;   // when the feature is a whole facet
};

// World frame, from A towards B: max n.A <= min n.B over the reals for the n that was found, of
// which `direction` is the rounding to unit length.
//
// FACET_A and FACET_B name the line: the direction may be minus the facet's outward normal, as in
// the textbook, which tests each line once. The features are those of the direction.
struct SeparatingAxis {
  Vector direction;
  AxisKind kind;
  Feature feature_a;  // where A reaches farthest along n
  Feature feature_b;  // where B reaches least far
};

// The textbook's report.
struct Analysis {
  std::chrono::nanoseconds time{0};
  // Textbook: up to and including the reported axis, counted as if serial, or all. Search:
  // directions tried.
  uint64_t axes_tested = 0;
  // Textbook: candidates in all, parallel edge pairs included. Otherwise 0.
  uint64_t axes_total = 0;
  // Where separation, or when touching the first zero gap, was found: the kind of the axis. Known
  // to the textbook; to the search when an axis or the stage is wanted.
  std::optional<AxisKind> stage;
  std::optional<uint64_t> axis_index;  // textbook: the index of that axis, from 0
};

struct QueryOptions {
  Method method = Method::kCertifiedSearch;
  bool want_axis = false;
  // Whether Analysis::stage must be known; the rest of the analysis costs nothing.
  bool want_stage = false;
  // Textbook only: more candidate axes than this are refused.
  uint64_t max_textbook_axes = std::numeric_limits<uint64_t>::max();
  // Polled inside long loops, possibly from several threads; true ends the query with CANCELLED.
  // May be empty.
  std::function<bool()> should_stop;
  // Textbook only: threads of the loop over axes.
  int threads = 1;
};

struct Answer {
  Relation relation = Relation::kSeparated;
  Rung rung = Rung::kExact;
  // When wanted, the relation is SEPARATED or TOUCHING, and neither hull is empty.
  std::optional<SeparatingAxis> axis;
  Analysis analysis;
};

// The exact relation of hull A at pose X_WA and hull B at pose X_WB, for every finite input.
// Requires valid poses (ValidatePose); otherwise INVALID_ARGUMENT. RESOURCE_EXHAUSTED: the textbook
// method would test more axes than allowed. CANCELLED: should_stop said so.
absl::StatusOr<Answer> CheckCollision(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, const QueryOptions& options = {});

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_COLLISION_H_
