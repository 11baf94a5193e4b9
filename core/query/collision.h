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

// Computes the relation of rounded hulls A and B at their poses, exact for every finite input, and
// the details requested by the options. `cache` may be null and does not change the relation, the
// separation or its bound. Swapping A and B mirrors the answer. INVALID_ARGUMENT: see
// ValidateOptions; the textbook method for a hull with a radius. RESOURCE_EXHAUSTED: the textbook
// method would test more axes than allowed. CANCELLED: should_stop returned true.
absl::StatusOr<Answer> CheckCollision(const PlacedHull& a, const PlacedHull& b,
                                      const QueryOptions& options = {}, PairCache* cache = nullptr);

// A resumable CheckCollision by the textbook method, with the same answer and cost. Callers may
// interleave other work between two steps.
class TextbookCheck {
 public:
  // All arguments must outlive the check. Requires: options.method is the textbook. Errors: see
  // CheckCollision, except CANCELLED.
  static absl::StatusOr<TextbookCheck> Begin(const PlacedHull& a, const PlacedHull& b,
                                             const QueryOptions& options);

  // Works until `end`, but makes progress in every call. Returns true if only Finish remains.
  // CANCELLED: should_stop returned true.
  absl::StatusOr<bool> Advance(std::chrono::steady_clock::time_point end);

  // Requires: Advance returned true. CANCELLED: should_stop returned true.
  absl::StatusOr<Answer> Finish();

  // Memory of the search (TextbookSearch); 0 if a hull is empty.
  size_t MemoryBytes() const { return search_.has_value() ? search_->MemoryBytes() : 0; }

 private:
  TextbookCheck(const PlacedHull& a, const PlacedHull& b, const QueryOptions& options)
      : a_(&a), b_(&b), options_(&options) {}

  const PlacedHull* a_;
  const PlacedHull* b_;
  const QueryOptions* options_;
  // None if a hull is empty.
  std::optional<TextbookSearch> search_;
  std::chrono::steady_clock::duration time_{0};
};

// CheckCollision for hulls that are queried only once: builds and discards their QueryHulls.
// INVALID_ARGUMENT also for invalid poses (ValidatePose).
absl::StatusOr<Answer> CheckCollision(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, const QueryOptions& options = {});

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_COLLISION_H_
