#include "core/query/batch.h"

#include <absl/status/status.h>

#include <algorithm>
#include <atomic>

namespace hulld {
namespace {

// Pairs differ in cost by orders of magnitude, hence small pieces handed out as threads come free.
constexpr int kPairsPerPiece = 16;

}  // namespace

std::vector<absl::StatusOr<Answer>> CheckCollisions(std::span<const PlacedHull> placements,
                                                    std::span<const PlacedPair> pairs,
                                                    const QueryOptions& options, int threads) {
  // Without a message the status is a number: with one, all answers would share and count it.
  std::vector<absl::StatusOr<Answer>> answers(pairs.size(), absl::CancelledError());
  QueryOptions each = options;
  each.threads = 1;
  const auto count = static_cast<int64_t>(pairs.size());
  std::atomic<bool> stopped = false;
#pragma omp parallel for schedule(dynamic, kPairsPerPiece) num_threads(std::max(1, threads))
  for (int64_t i = 0; i < count; ++i) {
    if (stopped.load(std::memory_order_relaxed)) continue;
    // Most pairs take less time than the question whether to stop, hence once a piece.
    if (i % kPairsPerPiece == 0 && each.should_stop && each.should_stop()) {
      stopped = true;
      continue;
    }
    const PlacedPair pair = pairs[i];
    answers[i] = CheckCollision(placements[pair.a], placements[pair.b], each);
  }
  return answers;
}

}  // namespace hulld
