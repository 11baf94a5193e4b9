#ifndef HULLD_CORE_QUERY_TEXTBOOK_SAT_H_
#define HULLD_CORE_QUERY_TEXTBOOK_SAT_H_

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <memory>

#include "core/query/placed/placed_hull.h"
#include "core/query/terms/answer.h"
#include "core/query/terms/query_options.h"

namespace hulld {

// The separating axis test as textbooks have it, with exact signs: reference, oracle and baseline.
//
// Candidate axes, in this order: facet normals of A, facet normals of B, cross products of the
// edges of A with the edges of B (edge of A major) and, where A - B is flat, its normals and the
// in-plane normals of its edges, which the textbook forgets. On each, every vertex is projected, in
// floating point with a proven bound; where that leaves the order of the intervals open, exactly.
// The lowest-numbered strictly separating axis decides SEPARATED, otherwise the lowest with zero
// gap TOUCHING; otherwise the hulls are OVERLAPPING. The axes are shared among options.threads
// OpenMP threads; the answer and its report do not depend on their number. Cost: O(E_A E_B (V_A +
// V_B)). Source: Gottschalk 1996, Separating axis theorem; Eberly 2001, Dynamic Collision Detection
// using Oriented Bounding Boxes.
//
// Requires both hulls not empty. RESOURCE_EXHAUSTED: more axes than options.max_textbook_axes.
// CANCELLED: should_stop.
absl::StatusOr<Answer> TextbookSat(const PlacedHull& a, const PlacedHull& b,
                                   const QueryOptions& options);

// The same in pieces, for callers that must let others have their turn.
class TextbookSearch {
 public:
  using Clock = std::chrono::steady_clock;

  // All must outlive the search. Errors as TextbookSat's, but for CANCELLED.
  static absl::StatusOr<TextbookSearch> Begin(const PlacedHull& a, const PlacedHull& b,
                                              const QueryOptions& options);
  TextbookSearch(TextbookSearch&&) noexcept;
  TextbookSearch& operator=(TextbookSearch&&) noexcept;
  ~TextbookSearch();

  // Tests axes until `end`, but some at least. Whether the answer is known. CANCELLED: should_stop.
  absl::StatusOr<bool> Advance(Clock::time_point end);

  // Requires that Advance said so.
  Answer Finish();

  // What it holds: every vertex of both hulls in integers, some 500 bytes each.
  size_t MemoryBytes() const;

 private:
  struct State;

  explicit TextbookSearch(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TEXTBOOK_SAT_H_
