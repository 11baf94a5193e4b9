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
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/pose.h"

namespace hulld {

// QueryOptions::max_error by default, relative to the largest absolute coordinates of the two
// hulls, each about its centre, and the separation.
inline constexpr double kDefaultRelativeMaxError = 1e-12;

// The relation of two closed convex sets A and B, over the reals. An empty hull is separated from
// all.
enum class Relation {
  kSeparated,        // no common point
  kTouching,         // 0 is on the boundary of A - B
  kOverlapping,      // 0 is interior to A - B
  kWithinTolerance,  // |separation| <= QueryOptions::tolerance; neither colliding nor not
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
enum class Rung {
  kBounds,         // spheres round the hulls; for the relation alone, their reach between centres
  kCached,         // the axis or the vertex pairs of the previous query of the pair
  kFloatingPoint,  // the hulls, in floating point with a proven error bound
  kExact,          // exact arithmetic
};

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

// The signed separation: the distance when positive; minus the penetration depth, the distance from
// 0 to the boundary of A - B, when negative; 0 exactly when touching. |value - true value| <=
// bound, and the sign agrees with the relation. Where a double cannot hold the value it saturates
// and the bound is infinite.
struct Separation {
  double value = 0;
  double bound = 0;
};

// Points of A and B, world frame, that attain the separation: at the distance of each other when
// separated, a common point when touching, and when overlapping those that coincide after the
// shortest translation that ends the overlap. `error`: how far each may be from a point of its hull
// and from attaining the separation. Where several are equally good, one of them.
struct Witness {
  Vector p_WA;
  Vector p_WB;
  double error = 0;
};

struct QueryOptions {
  Method method = Method::kCertifiedSearch;
  bool want_axis = false;
  // Whether Analysis::time and Analysis::stage must be known; the rest of the analysis costs
  // nothing.
  bool want_analysis = false;
  bool want_certificate = false;
  bool want_separation = false;
  bool want_witness = false;
  // The largest bound of a wanted separation that will do, in the caller's length unit; absent:
  // kDefaultRelativeMaxError times the sizes of the hulls and the separation. Where a double cannot
  // hold the value so well, the bound is that of its rounding.
  std::optional<double> max_error;
  // Answer::within_clearance: separation <= this, exactly; always at infinity, never at -infinity.
  std::optional<double> clearance;
  // tau >= 0, length. 0: the relation is exact, always. Positive: it may be kWithinTolerance where
  // |separation| <= tau. Not with a wanted separation, witness, clearance or certificate, nor the
  // textbook: these need the relation, and INVALID_ARGUMENT says so.
  double tolerance = 0;
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
  // When wanted and neither hull is empty.
  std::optional<Certificate> certificate;
  // When wanted; infinite when a hull is empty.
  std::optional<Separation> separation;
  // When wanted and neither hull is empty.
  std::optional<Witness> witness;
  // When wanted: whether separation <= QueryOptions::clearance. False when a hull is empty.
  std::optional<bool> within_clearance;
};

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

// The relation of hull A and hull B at their poses, exact for every finite input, and what else the
// options ask for. `cache` may be null; with it the relation, the separation and its bound are
// those without it. Swapping A and B mirrors the answer.
// INVALID_ARGUMENT: options that exclude each other, a negative or NaN tolerance or max_error, a
// NaN clearance. RESOURCE_EXHAUSTED: the textbook method would test more axes than allowed.
// CANCELLED: should_stop said so.
absl::StatusOr<Answer> CheckCollision(const PlacedHull& a, const PlacedHull& b,
                                      const QueryOptions& options = {}, PairCache* cache = nullptr);

// The same for hulls that are asked about once: makes what queries need of them (QueryHull), and
// drops it. INVALID_ARGUMENT also for poses that are not valid (ValidatePose).
absl::StatusOr<Answer> CheckCollision(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, const QueryOptions& options = {});

struct RelationAnswer {
  Relation relation;
  Rung rung;
};

// The relation alone, as CheckCollision finds it with this tolerance: the fastest way to ask.
// Requires tolerance >= 0.
RelationAnswer FindRelation(const PlacedHull& a, const PlacedHull& b, PairCache* cache = nullptr,
                            double tolerance = 0);
// The same, but CANCELLED when should_stop, which may be empty, said so.
absl::StatusOr<RelationAnswer> FindRelation(const PlacedHull& a, const PlacedHull& b,
                                            double tolerance,
                                            const std::function<bool()>& should_stop);

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_COLLISION_H_
