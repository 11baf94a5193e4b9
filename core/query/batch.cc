#include "core/query/batch.h"

#include <absl/status/status.h>

#include <algorithm>

namespace hulld {

std::vector<absl::StatusOr<Answer>> CheckCollisions(std::span<const PlacedHull> placements,
                                                    std::span<const PlacedPair> pairs,
                                                    const QueryOptions& options, int threads) {
  // Without a message the status is a number: with one, all answers would share and count it.
  std::vector<absl::StatusOr<Answer>> answers(pairs.size(), absl::CancelledError());
  QueryOptions each = options;
  each.threads = 1;
  const auto count = static_cast<int64_t>(pairs.size());
  // Pairs differ in cost by orders of magnitude, hence small pieces handed out as threads come
  // free.
  constexpr int kPairsPerPiece = 16;
#pragma omp parallel for schedule(dynamic, kPairsPerPiece) num_threads(std::max(1, threads))
  for (int64_t i = 0; i < count; ++i) {
    if (each.should_stop && each.should_stop()) {
      answers[i] = absl::CancelledError("stopped");
      continue;
    }
    answers[i] = CheckCollision(placements[pairs[i].a], placements[pairs[i].b], each);
  }
  return answers;
}

}  // namespace hulld
