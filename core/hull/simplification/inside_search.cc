#include "core/hull/simplification/inside_search.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/hull/simplification/relaxation.h"

namespace hulld {
namespace {

// Number of attempts, and moves of all vertices in each. More gain little. Observed on a sphere of
// 1e5 vertices: farthest first takes 1.7 times the fewest, 1.50 with the first attempt, 1.43 with
// the sixth.
constexpr int kAttempts = 6;
constexpr int kMovesPerAttempt = 4;
// Attempts without gain after which the search ends.
constexpr int kAttemptsInVain = 2;
// Moves of single vertices, per vertex of the hull, after which no further attempt starts. The
// limit is reached if a large part of the vertices is chosen, and then there is little choice.
constexpr size_t kMovesPerVertex = 3;

}  // namespace

InsideSearch::InsideSearch(const Hull& hull, double max_error, size_t most, StopPoll& poll)
    : hull_(hull),
      max_error_(max_error),
      most_(most),
      poll_(poll),
      scale_(hull.max_abs_coordinate()),
      order_(hull, scale_, poll) {}

void InsideSearch::Run() {
  if (poll_.stopped()) return;
  const size_t count = order_.CountFor(max_error_, most_);
  best_ = {order_.First(count), order_.ErrorAt(count)};
  if (poll_.stopped() || hull_.dimension() < 3) return;
  // With the fewest vertices, or all of them, no gain is possible.
  if (Reaches(best_) && (count == order_.least() || count == hull_.vertices().size())) return;
  // An attempt finds the triangles of all vertices, which is slow in integers.
  if (!order_.IsMeasurable()) return;
  Improve();
}

void InsideSearch::Improve() {
  Relaxation relaxation(hull_, order_.unit_points(), poll_);
  if (poll_.stopped()) return;
  std::vector<uint32_t> chosen =
      order_.First(std::max(order_.least(), best_.vertices.size() * 4 / 5));
  const size_t most_moves = kMovesPerVertex * (hull_.vertices().size() + 1024);
  size_t moves = 0;
  bool has_gained = false;
  for (int attempt = 0; attempt < kAttempts && moves < most_moves; ++attempt) {
    if (attempt == kAttemptsInVain && !has_gained) return;
    for (int move = 0; move < kMovesPerAttempt; ++move) {
      moves += chosen.size();
      auto moved =
          attempt > 0 && move == 0 ? relaxation.MoveFewer(chosen) : relaxation.Move(chosen);
      if (!moved) return;
      chosen = *std::move(moved);
    }
    auto subset = VertexSubset::StartingWith(chosen, hull_.vertices(), order_.unit_points(), poll_);
    if (!subset) return;
    // Slightly more than the best has, so that the next attempt starts from a choice that is near
    // enough everywhere.
    const size_t best = best_.vertices.size();
    const size_t end = Reaches(best_) ? std::min(most_, best + best / 20) : most_;
    const auto error = [&] {
      return subset->is_complete() ? 0 : scale_.LengthFromUnit(subset->DistanceBound());
    };
    while (subset->chosen().size() < end && error() > max_error_) {
      subset->ChooseNext(poll_);
      if (poll_.stopped()) return;
    }
    has_gained |= Consider(*subset, error());
    chosen = subset->chosen();
  }
}

// Keeps the choice if it is better than the best: near enough with fewer vertices, or nearer.
bool InsideSearch::Consider(const VertexSubset& subset, double error) {
  const size_t count = subset.chosen().size();
  const bool reaches = error <= max_error_;
  const bool is_better = reaches != Reaches(best_) ? reaches
                         : reaches                 ? count < best_.vertices.size()
                                                   : error < best_.error;
  if (is_better) best_ = {subset.chosen(), error};
  return is_better;
}

}  // namespace hulld
