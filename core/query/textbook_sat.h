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

// The textbook separating-axis test with exact signs, as a reference, an oracle, and a baseline.
//
// Candidate axes, in this order: facet normals of A, facet normals of B, cross products of the
// edges of A with the edges of B (edge of A major) and, if A - B is flat, its normals and the
// in-plane normals of its edges, which the textbook omits. Each test projects every vertex, in
// floating point with a proven bound, and exactly if the bound leaves the order of the intervals
// open. The lowest-numbered strictly separating axis decides SEPARATED, otherwise the lowest with
// zero gap TOUCHING; otherwise the hulls are OVERLAPPING. options.threads OpenMP threads share the
// axes; the answer and its report do not depend on their number.
//
// Requires: both hulls not empty. RESOURCE_EXHAUSTED: more axes than options.max_textbook_axes.
// CANCELLED: should_stop returned true. Cost: O(E_A E_B (V_A + V_B)). Source: Gottschalk 1996,
// Separating axis theorem; Eberly 2001, Dynamic Collision Detection using Oriented Bounding Boxes.
absl::StatusOr<Answer> TextbookSat(const PlacedHull& a, const PlacedHull& b,
                                   const QueryOptions& options);

// A resumable TextbookSat, for callers that must interleave other work.
class TextbookSearch {
 public:
  using Clock = std::chrono::steady_clock;

  // All arguments must outlive the search. Errors: see TextbookSat.
  static absl::StatusOr<TextbookSearch> Begin(const PlacedHull& a, const PlacedHull& b,
                                              const QueryOptions& options);
  TextbookSearch(TextbookSearch&&) noexcept;
  TextbookSearch& operator=(TextbookSearch&&) noexcept;
  ~TextbookSearch();

  // Tests axes until `end`, at least some in every call. Returns true if the answer is known.
  // CANCELLED: should_stop returned true.
  absl::StatusOr<bool> Advance(Clock::time_point end);

  // Requires: Advance returned true. CANCELLED: should_stop returned true.
  absl::StatusOr<Answer> Finish();

  // Memory: positions of the vertices of both hulls. Once floating point leaves an axis open, also
  // every vertex in integers, about 500 bytes each.
  size_t MemoryBytes() const;

 private:
  struct State;

  explicit TextbookSearch(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TEXTBOOK_SAT_H_
