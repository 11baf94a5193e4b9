#include "core/query/scene.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/query/box_tree.h"
#include "core/query/collision.h"

namespace hulld {
namespace {

// Between two calls of emit as many placements are searched as gave so many candidates last time,
// about: enough to keep the threads busy, few enough for answers to flow and memory to stay small.
constexpr uint64_t kCandidatesPerSlice = 16384;
constexpr uint32_t kFirstSlicePlacements = 16;
constexpr uint32_t kMostSlicePlacements = 1024;

// What the search of one placement counted.
struct RungTally {
  uint64_t candidates = 0;
  RungCounts rungs;
};

class Search {
 public:
  Search(const SceneSearch& scene, const SceneOptions& options)
      : scene_(scene), options_(options) {}

  absl::StatusOr<SceneTotals> Run(const std::function<void(std::span<const SceneAnswer>)>& emit) {
    SceneTotals totals;
    totals.pairs = scene_.pairs();
    const int threads = std::max(1, options_.threads);
    std::vector<std::vector<SceneAnswer>> slice(kMostSlicePlacements);
    std::vector<RungTally> slice_rungs(kMostSlicePlacements);
    uint32_t slice_placements = kFirstSlicePlacements;
    std::vector<SceneAnswer> answers;
    for (uint32_t begin = 0, size = 0; begin < scene_.size(); begin += size) {
      size = std::min(slice_placements, scene_.size() - begin);
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads)
      for (uint32_t i = 0; i < size; ++i) {
        slice[i].clear();
        slice_rungs[i] = {};
        if (!Stopped()) SearchFrom(begin + i, slice[i], slice_rungs[i]);
      }
      if (Stopped()) return absl::CancelledError("stopped in a scene");
      answers.clear();
      uint64_t candidates = 0;
      for (uint32_t i = 0; i < size; ++i) {
        std::move(slice[i].begin(), slice[i].end(), std::back_inserter(answers));
        candidates += slice_rungs[i].candidates;
        totals.rungs += slice_rungs[i].rungs;
      }
      totals.candidates += candidates;
      totals.found += answers.size();
      if (!answers.empty()) emit(answers);
      const uint64_t wished = kCandidatesPerSlice * size / std::max<uint64_t>(candidates, 1);
      slice_placements = static_cast<uint32_t>(
          std::clamp<uint64_t>(wished, 1, std::min(2 * size, kMostSlicePlacements)));
    }
    return totals;
  }

 private:
  bool Stopped() const { return StopPoll(options_.query.should_stop, 1).Poll(); }

  // Answers placement a with all after it.
  void SearchFrom(uint32_t a, std::vector<SceneAnswer>& answers, RungTally& tally) const {
    std::vector<uint32_t> candidates;
    scene_.Candidates(a, candidates);
    for (const uint32_t b : candidates) {
      ++tally.candidates;
      absl::StatusOr<Answer> answer = scene_.Ask(a, b);
      if (absl::IsCancelled(answer.status())) break;
      if (answer.ok()) tally.rungs.Add(answer->rung);
      if (answer.ok() && !scene_.IsFound(*answer)) continue;
      answers.push_back({{a, b}, std::move(answer)});
    }
  }

  const SceneSearch& scene_;
  const SceneOptions& options_;
};

}  // namespace

SceneSearch::SceneSearch(std::span<const PlacedHull> placements, const SceneOptions& options)
    : placements_(placements), options_(&options), first_look_(options.query) {
  first_look_.want_axis = false;
  first_look_.want_analysis = false;
  first_look_.want_certificate = false;
  first_look_.want_separation = false;
  first_look_.want_witness = false;
  first_look_.threads = 1;
  for (const GroupPair& pair : options.ignored_groups) {
    ignored_.insert(std::minmax(pair.first, pair.second));
  }
  const auto count = static_cast<uint32_t>(placements.size());
  boxes_.resize(count);
#pragma omp parallel for schedule(static) num_threads(std::max(1, options.threads))
  for (uint32_t i = 0; i < count; ++i) {
    boxes_[i] = IsBody(i) ? BoundingBox(options.bodies[i]) : BoundingBox(placements_[i]);
  }
  tree_ = BoxTree(boxes_);
  pairs_ = CountPairs();
  size_ = options.movers ? std::min(*options.movers, count) : count;
}

absl::StatusOr<SceneSearch> SceneSearch::Make(std::span<const PlacedHull> placements,
                                              const SceneOptions& options) {
  if (!options.groups.empty() && options.groups.size() != placements.size()) {
    return absl::InvalidArgumentError(absl::StrCat("groups holds ", options.groups.size(),
                                                   " groups for ", placements.size(),
                                                   " placements; give one each, or none"));
  }
  HULLD_CHECK(options.bodies.empty() || options.bodies.size() == placements.size());
  return SceneSearch(placements, options);
}

bool SceneSearch::IsIgnored(uint32_t a, uint32_t b) const {
  if (options_->groups.empty() || ignored_.empty()) return false;
  return ignored_.contains(std::minmax(options_->groups[a], options_->groups[b]));
}

// Pairs that are asked about, by counting groups rather than pairs.
uint64_t SceneSearch::CountPairs() const {
  const auto pairs_among = [](uint64_t n) { return n * (n - (n > 0)) / 2; };
  const uint64_t count = placements_.size();
  const uint64_t movers = options_->movers ? std::min<uint64_t>(*options_->movers, count) : count;
  uint64_t pairs = pairs_among(count) - pairs_among(count - movers);
  if (options_->groups.empty()) return pairs;
  // Of each group how many are movers and how many are not.
  std::map<uint32_t, std::pair<uint64_t, uint64_t>> sizes;
  for (uint32_t i = 0; i < count; ++i) {
    auto& [moving, resting] = sizes[options_->groups[i]];
    ++(i < movers ? moving : resting);
  }
  for (const auto& [first, second] : ignored_) {
    const auto [m, r] = sizes[first];
    const auto [n, s] = sizes[second];
    pairs -= first == second ? pairs_among(m) + m * r : m * n + m * s + r * n;
  }
  return pairs;
}

void SceneSearch::Candidates(uint32_t a, std::vector<uint32_t>& candidates) const {
  HULLD_DCHECK(a < size_);
  const Box box = GrownBy(boxes_[a], options_->query.clearance.value_or(0));
  candidates.clear();
  tree_.AppendMeeting(box, a + 1, candidates);
  std::erase_if(candidates, [&](uint32_t b) { return IsIgnored(a, b); });
  std::sort(candidates.begin(), candidates.end());
}

bool SceneSearch::IsFound(const Answer& answer) const {
  if (options_->query.clearance) return answer.within_clearance.value_or(false);
  return answer.relation != Relation::kSeparated;
}

absl::StatusOr<Answer> SceneSearch::AskWith(uint32_t a, uint32_t b, const QueryOptions& options,
                                            std::optional<PiecePair>* pieces) const {
  if (!IsBody(a) && !IsBody(b)) return CheckCollision(placements_[a], placements_[b], options);
  absl::StatusOr<BodyAnswer> answer =
      CheckBodies(options_->bodies[a], options_->bodies[b], options);
  if (!answer.ok()) return answer.status();
  if (pieces != nullptr) *pieces = answer->pieces;
  return std::move(answer->answer);
}

absl::StatusOr<Answer> SceneSearch::Ask(uint32_t a, uint32_t b,
                                        std::optional<PiecePair>* pieces) const {
  absl::StatusOr<Answer> answer = AskWith(a, b, first_look_, pieces);
  if (!options_->query.WantsDetails() || !answer.ok() || !IsFound(*answer)) return answer;
  QueryOptions options = options_->query;
  options.threads = 1;
  return AskWith(a, b, options, pieces);
}

absl::StatusOr<SceneTotals> FindCollisions(
    std::span<const PlacedHull> placements, const SceneOptions& options,
    const std::function<void(std::span<const SceneAnswer>)>& emit) {
  const absl::StatusOr<SceneSearch> scene = SceneSearch::Make(placements, options);
  if (!scene.ok()) return scene.status();
  return Search(*scene, options).Run(emit);
}

}  // namespace hulld
