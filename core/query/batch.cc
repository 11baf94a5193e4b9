#include "core/query/batch.h"

#include <absl/status/status.h>

#include <algorithm>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/query/collision.h"

namespace hulld {
namespace {

// Pairs differ in cost by orders of magnitude, so idle threads take small chunks.
constexpr int kPairsPerPiece = 16;

}  // namespace

std::vector<absl::StatusOr<Answer>> CheckCollisions(std::span<const PlacedHull> placements,
                                                    std::span<const PlacedPair> pairs,
                                                    const QueryOptions& options, int threads) {
  // A status without a message is a plain number. A message would be reference-counted and shared
  // by all answers.
  std::vector<absl::StatusOr<Answer>> answers(pairs.size(), absl::CancelledError());
  QueryOptions each = options;
  each.threads = 1;
  const auto count = static_cast<int64_t>(pairs.size());
#pragma omp parallel num_threads(std::max(1, threads))
  {
    // Polling takes longer than most pairs, so each thread polls once per chunk.
    StopPoll poll(each.should_stop, kPairsPerPiece);
#pragma omp for schedule(dynamic, kPairsPerPiece)
    for (int64_t i = 0; i < count; ++i) {
      if (poll.Step()) continue;
      const PlacedPair pair = pairs[i];
      HULLD_CHECK(pair.a < placements.size() && pair.b < placements.size());
      answers[i] = CheckCollision(placements[pair.a], placements[pair.b], each);
    }
  }
  return answers;
}

}  // namespace hulld
