#ifndef HULLD_CORE_QUERY_COLLISION_H_
#define HULLD_CORE_QUERY_COLLISION_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <optional>

#include "core/hull/hull.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/pair_cache.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/query_options.h"
#include "core/query/textbook_sat.h"

namespace hulld {

// The relation of hull A and hull B at their poses, exact for every finite input, and what else the
// options ask for. `cache` may be null; with it the relation, the separation and its bound are
// those without it. Swapping A and B mirrors the answer.
// INVALID_ARGUMENT: ValidateOptions. RESOURCE_EXHAUSTED: the textbook method would test more axes
// than allowed. CANCELLED: should_stop said so.
absl::StatusOr<Answer> CheckCollision(const PlacedHull& a, const PlacedHull& b,
                                      const QueryOptions& options = {}, PairCache* cache = nullptr);

// CheckCollision by the textbook method in pieces: the answer and its cost are the same, and others
// may have their turn between two pieces.
class TextbookCheck {
 public:
  // All must outlive the check. Requires options.method to be the textbook. Errors: those of
  // CheckCollision, but for CANCELLED.
  static absl::StatusOr<TextbookCheck> Begin(const PlacedHull& a, const PlacedHull& b,
                                             const QueryOptions& options);

  // Works until `end`, but a little at least. Whether Finish is all that is left. CANCELLED:
  // should_stop said so.
  absl::StatusOr<bool> Advance(std::chrono::steady_clock::time_point end);

  // Requires that Advance said so. CANCELLED: should_stop said so.
  absl::StatusOr<Answer> Finish();

  // What it holds (TextbookSearch); nothing where a hull is empty.
  size_t MemoryBytes() const { return search_.has_value() ? search_->MemoryBytes() : 0; }

 private:
  TextbookCheck(const PlacedHull& a, const PlacedHull& b, const QueryOptions& options)
      : a_(&a), b_(&b), options_(&options) {}

  const PlacedHull* a_;
  const PlacedHull* b_;
  const QueryOptions* options_;
  // None where a hull is empty.
  std::optional<TextbookSearch> search_;
  std::chrono::steady_clock::duration time_{0};
};

// The same for hulls that are asked about once: makes what queries need of them (QueryHull), and
// drops it. INVALID_ARGUMENT also for poses that are not valid (ValidatePose).
absl::StatusOr<Answer> CheckCollision(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, const QueryOptions& options = {});

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_COLLISION_H_
