#include "client/hullctl/robot/waypoint_stream.h"

#include <algorithm>
#include <utility>

namespace hulld {
namespace {

// Enough to amortize the round trip. Observed, 18 pairs of a UR5: 2.4 million pairs per second.
constexpr size_t kPairsPerMessage = 4096;
constexpr size_t kMaxLanes = 1024;

}  // namespace

WaypointStream::WaypointStream(const Client& client, CheckScope scope, v1::Wanted wanted,
                               double tolerance, Receiver receive)
    : client_(client),
      scope_(std::move(scope)),
      wanted_(std::move(wanted)),
      tolerance_(tolerance),
      receive_(std::move(receive)) {
  const size_t pairs = std::max<size_t>(1, scope_.pairs.size() / 2);
  lanes_ = std::clamp<size_t>(kPairsPerMessage / pairs, 1, kMaxLanes);
}

absl::Status WaypointStream::Query(size_t count, const std::vector<double>& poses) {
  const auto answer = stream_ == nullptr ? Open(count, poses) : Update(count, poses);
  return answer.ok() ? Take(*answer, count) : answer.status();
}

absl::Status WaypointStream::Close() {
  return stream_ == nullptr ? absl::OkStatus() : stream_->Close();
}

absl::StatusOr<v1::StreamCollisionsResponse> WaypointStream::Open(
    size_t count, const std::vector<double>& poses) {
  const auto all_parts = static_cast<uint32_t>(count) * scope_.parts;
  const auto fixed = static_cast<uint32_t>(scope_.hull_of.size()) - scope_.parts;
  v1::CollisionStreamOpen open;
  v1::PackedPlacements* const packed = open.mutable_packed_placements();
  *packed = scope_.hulls;
  for (uint32_t placement = 0; placement < all_parts + fixed; ++placement) {
    const uint32_t object =
        placement < all_parts ? placement % scope_.parts : placement - all_parts + scope_.parts;
    packed->add_hulls(scope_.hull_of[object]);
    packed->add_radii(scope_.radii[object]);
  }
  packed->mutable_poses()->Add(poses.begin(), poses.end());
  packed->mutable_poses()->Add(scope_.fixed_poses.begin(), scope_.fixed_poses.end());
  for (uint32_t lane = 0; lane < count; ++lane) {
    for (const uint32_t object : scope_.pairs) {
      open.add_pairs(PlacementOf(lane, object, count));
    }
  }
  *open.mutable_wanted() = wanted_;
  open.set_tolerance(tolerance_);
  open_lanes_ = count;
  stream_ = client_.OpenCollisionStream();
  return stream_->Open(std::move(open));
}

absl::StatusOr<v1::StreamCollisionsResponse> WaypointStream::Update(
    size_t count, const std::vector<double>& poses) {
  if (count > open_lanes_) {
    return absl::InternalError("a message has more waypoints than the first one");
  }
  v1::CollisionStreamUpdate update;
  for (uint32_t i = 0; i < count * scope_.parts; ++i) update.add_placements(i);
  update.mutable_poses()->Add(poses.begin(), poses.end());
  return stream_->Update(std::move(update));
}

uint32_t WaypointStream::PlacementOf(uint32_t lane, uint32_t object, size_t lanes) const {
  const bool moves = object < scope_.parts;
  return (moves ? lane : static_cast<uint32_t>(lanes) - 1) * scope_.parts + object;
}

std::string WaypointStream::ProblemOf(uint32_t lane, size_t pair) const {
  for (const size_t side : {2 * pair, 2 * pair + 1}) {
    const uint32_t placement = PlacementOf(lane, scope_.pairs[side], open_lanes_);
    const auto found = placement_problems_.find(placement);
    if (found != placement_problems_.end()) return found->second;
  }
  return "the server gave no reason";
}

absl::Status WaypointStream::Take(const v1::StreamCollisionsResponse& answer, size_t count) {
  const size_t pairs = scope_.pairs.size() / 2;
  const auto rows = static_cast<size_t>(answer.pairs_size());
  if (rows != count * pairs || !AreParallel(answer.columns(), rows)) {
    return absl::InternalError("the answer's columns and pairs disagree");
  }
  for (const v1::PlacementProblem& problem : answer.placement_problems()) {
    placement_problems_[problem.placement()] = problem.message();
  }
  std::unordered_map<uint64_t, std::string> problems;
  for (const v1::PairProblem& problem : answer.columns().pair_problems()) {
    problems[problem.row()] = problem.message();
  }
  for (size_t i = 0; i < rows; ++i) {
    if (answer.pairs(static_cast<int>(i)) != i) {
      return absl::InternalError("a pair that moved is missing from the answer");
    }
    const AnswerRow row = RowAt(answer.columns(), static_cast<int>(i));
    const size_t lane = i / pairs;
    std::string problem;
    if (row.relation == v1::RELATION_UNSPECIFIED) {
      const auto found = problems.find(i);
      problem = found != problems.end() ? found->second
                                        : ProblemOf(static_cast<uint32_t>(lane), i % pairs);
    }
    receive_(waypoints_ + lane, i % pairs, row, problem);
  }
  waypoints_ += count;
  return absl::OkStatus();
}

}  // namespace hulld
