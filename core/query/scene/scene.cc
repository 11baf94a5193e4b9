#include "core/query/scene/scene.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <bit>
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

// Candidates are gathered for a window of consecutive placements. A window holds about as many
// placements as would have produced kCandidatesPerWindow candidates in the previous window, enough
// to keep the threads busy.
constexpr uint64_t kCandidatesPerWindow = 16384;
constexpr uint32_t kFirstPlacements = 16;
constexpr uint32_t kMaxPlacements = 1024;
// Pairs per task of a thread: a few microseconds of work.
constexpr size_t kPairsPerTask = 64;
// Tree nodes visited between two polls.
constexpr uint64_t kNodesPerPoll = 1024;
// Beyond this many candidates, a bit set of all placements takes less memory.
constexpr size_t kMaxListed = 1024;
constexpr size_t kWordBits = 64;

// Results of a thread.
struct ThreadResults {
  std::vector<SceneAnswer> answers;
  RungCounts rungs;
};

// Gathers the candidates of a window of placements, then queries them in bounded batches. Threads
// share both phases. Memory does not grow with the number of collisions.
class Search {
 public:
  Search(const SceneSearch& scene, const SceneOptions& options)
      : scene_(scene), options_(options), threads_(std::max(1, options.threads)) {
    totals_.pairs = scene.pairs();
    pairs_.reserve(kMaxEmittedAnswers);
  }

  absl::StatusOr<SceneTotals> Run(const std::function<void(std::span<const SceneAnswer>)>& emit) {
    std::vector<SceneCandidates> window(kMaxPlacements);
    uint32_t width = kFirstPlacements;
    for (uint32_t begin = 0, size = 0; begin < scene_.size(); begin += size) {
      size = std::min(width, scene_.size() - begin);
      const uint64_t before = totals_.candidates;
      Gather(begin, std::span(window).first(size));
      for (uint32_t i = 0; i < size && !Stopped(); ++i) {
        while (const std::optional<uint32_t> b = window[i].Next()) {
          pairs_.push_back({begin + i, *b});
          if (pairs_.size() == kMaxEmittedAnswers && !QueryAndEmit(emit)) break;
        }
      }
      if (Stopped() || !QueryAndEmit(emit)) {
        return absl::CancelledError("the scene query was cancelled");
      }
      const uint64_t candidates = std::max<uint64_t>(totals_.candidates - before, 1);
      width = static_cast<uint32_t>(std::clamp<uint64_t>(kCandidatesPerWindow * size / candidates,
                                                         1, std::min(2 * size, kMaxPlacements)));
    }
    return totals_;
  }

 private:
  // After should_stop returns true it is not polled again.
  bool Stopped() {
    if (!stopped_ && StopPoll(options_.query.should_stop, 1).Poll()) stopped_ = true;
    return stopped_;
  }

  void Gather(uint32_t begin, std::span<SceneCandidates> window) {
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads_)
    for (size_t i = 0; i < window.size(); ++i) {
      window[i].Start(scene_, begin + static_cast<uint32_t>(i));
      while (!Stopped() && !window[i].Gather(kNodesPerPoll)) {
      }
    }
  }

  // Answers the pending pairs in order. Returns false if stopped; then nothing was emitted.
  bool QueryAndEmit(const std::function<void(std::span<const SceneAnswer>)>& emit) {
    const size_t tasks = (pairs_.size() + kPairsPerTask - 1) / kPairsPerTask;
    if (parts_.size() < tasks) parts_.resize(tasks);
#pragma omp parallel for schedule(dynamic) num_threads(threads_)
    for (size_t task = 0; task < tasks; ++task) {
      parts_[task] = {};
      if (!Stopped()) Query(task);
    }
    if (Stopped()) return false;
    std::vector<SceneAnswer> answers;
    for (size_t task = 0; task < tasks; ++task) {
      std::vector<SceneAnswer>& found = parts_[task].answers;
      std::move(found.begin(), found.end(), std::back_inserter(answers));
      totals_.rungs += parts_[task].rungs;
    }
    totals_.candidates += pairs_.size();
    totals_.found += answers.size();
    pairs_.clear();
    if (!answers.empty()) emit(answers);
    return true;
  }

  void Query(size_t task) {
    const size_t end = std::min(pairs_.size(), (task + 1) * kPairsPerTask);
    for (size_t i = task * kPairsPerTask; i < end; ++i) {
      absl::StatusOr<Answer> answer = scene_.Query(pairs_[i].a, pairs_[i].b);
      if (absl::IsCancelled(answer.status())) return;
      if (answer.ok()) parts_[task].rungs.Add(answer->rung);
      if (answer.ok() && !scene_.IsFound(*answer)) continue;
      parts_[task].answers.push_back({pairs_[i], std::move(answer)});
    }
  }

  const SceneSearch& scene_;
  const SceneOptions& options_;
  const int threads_;
  std::atomic<bool> stopped_ = false;
  SceneTotals totals_;
  // Pending candidates, and their results.
  std::vector<PlacedPair> pairs_;
  std::vector<ThreadResults> parts_;
};

}  // namespace

SceneSearch::SceneSearch(std::span<const PlacedHull> placements, const SceneOptions& options)
    : placements_(placements), options_(&options), first_look_(options.query) {
  first_look_.want_axis = false;
  first_look_.want_analysis = false;
  first_look_.want_certificate = false;
  first_look_.want_separation = false;
  first_look_.want_witness = false;
  first_look_.want_normal = false;
  first_look_.threads = 1;
  for (const GroupPair& pair : options.ignored_groups) {
    ignored_.insert(std::minmax(pair.first, pair.second));
  }
  const auto count = static_cast<uint32_t>(placements.size());
  if (!options.groups.empty() && !ignored_.empty()) {
    first_others_.resize(count);
    for (uint32_t i = count; i-- > 0;) {
      const bool skips_next =
          i + 1 < count && options.groups[i] == options.groups[i + 1] && IsIgnored(i, i + 1);
      first_others_[i] = skips_next ? first_others_[i + 1] : i + 1;
    }
  }
  pairs_ = CountPairs();
  size_ = options.movers ? std::min(*options.movers, count) : count;
}

bool SceneSearch::ComputeBoxes() {
  const std::function<bool()>& should_stop = options_->query.should_stop;
  const auto count = static_cast<uint32_t>(placements_.size());
  boxes_.resize(count);
#pragma omp parallel num_threads(std::max(1, options_->threads))
  {
    StopPoll poll(should_stop);
#pragma omp for schedule(static)
    for (uint32_t i = 0; i < count; ++i) {
      if (poll.Step()) continue;
      boxes_[i] = IsBody(i) ? BoundingBox(options_->bodies[i]) : BoundingBox(placements_[i]);
    }
  }
  return !StopPoll(should_stop, 1).Poll();
}

bool SceneSearch::BuildTree() {
  if (size_ > 0) tree_first_ = std::min<uint32_t>(FirstCandidate(0), boxes_.size());
  tree_ = BoxTree(std::span(boxes_).subspan(tree_first_), options_->query.should_stop,
                  std::max(1, options_->threads));
  return !StopPoll(options_->query.should_stop, 1).Poll();
}

absl::StatusOr<SceneSearch> SceneSearch::Make(std::span<const PlacedHull> placements,
                                              const SceneOptions& options) {
  return MakeWith(placements, options, std::nullopt, {});
}

absl::StatusOr<SceneSearch> SceneSearch::Make(std::span<const PlacedHull> placements,
                                              const SceneOptions& options, std::vector<Box> boxes) {
  HULLD_CHECK(boxes.size() == placements.size());
  return MakeWith(placements, options, std::move(boxes), {});
}

absl::StatusOr<SceneSearch> SceneSearch::Make(std::span<const PlacedHull> placements,
                                              const SceneOptions& options,
                                              std::vector<MovingBox> boxes) {
  HULLD_CHECK(boxes.size() == placements.size());
  std::vector<Box> around(boxes.size());
  std::ranges::transform(boxes, around.begin(), &MovingBox::Around);
  return MakeWith(placements, options, std::move(around), std::move(boxes));
}

absl::StatusOr<SceneSearch> SceneSearch::MakeWith(std::span<const PlacedHull> placements,
                                                  const SceneOptions& options,
                                                  std::optional<std::vector<Box>> boxes,
                                                  std::vector<MovingBox> moving) {
  if (!options.groups.empty() && options.groups.size() != placements.size()) {
    return absl::InvalidArgumentError(absl::StrCat("groups has ", options.groups.size(),
                                                   " groups for ", placements.size(),
                                                   " placements; set one per placement, or none"));
  }
  HULLD_CHECK(options.bodies.empty() || options.bodies.size() == placements.size());
  SceneSearch scene(placements, options);
  scene.moving_ = std::move(moving);
  bool is_made = true;
  if (boxes.has_value()) {
    scene.boxes_ = *std::move(boxes);
  } else {
    is_made = scene.ComputeBoxes();
  }
  if (!is_made || !scene.BuildTree()) return absl::CancelledError("the scene query was cancelled");
  return scene;
}

bool SceneSearch::IsIgnored(uint32_t a, uint32_t b) const {
  if (options_->groups.empty() || ignored_.empty()) return false;
  return ignored_.contains(std::minmax(options_->groups[a], options_->groups[b]));
}

// Counts the pairs to query by groups, without enumerating them.
uint64_t SceneSearch::CountPairs() const {
  const auto pairs_among = [](uint64_t n) { return n * (n - (n > 0)) / 2; };
  const uint64_t count = placements_.size();
  const uint64_t movers = options_->movers ? std::min<uint64_t>(*options_->movers, count) : count;
  uint64_t pairs = pairs_among(count) - pairs_among(count - movers);
  if (options_->groups.empty()) return pairs;
  // Number of members of each group that are movers, and that are not.
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

bool SceneSearch::IsFound(const Answer& answer) const {
  if (options_->query.clearance) return answer.within_clearance.value_or(false);
  return answer.relation != Relation::kSeparated;
}

absl::StatusOr<Answer> SceneSearch::QueryWith(uint32_t a, uint32_t b, const QueryOptions& options,
                                              PiecesAnswer* of_body) const {
  if (!IsBody(a) && !IsBody(b)) return CheckCollision(placements_[a], placements_[b], options);
  absl::StatusOr<BodyAnswer> found = CheckBodies(options_->bodies[a], options_->bodies[b], options);
  if (!found.ok()) return found.status();
  if (of_body != nullptr) *of_body = std::move(static_cast<PiecesAnswer&>(*found));
  return std::move(found->answer);
}

absl::StatusOr<Answer> SceneSearch::Query(uint32_t a, uint32_t b, PiecesAnswer* of_body) const {
  absl::StatusOr<Answer> answer = QueryWith(a, b, first_look_, of_body);
  if (!options_->query.WantsDetails() || !answer.ok() || !IsFound(*answer)) return answer;
  QueryOptions options = options_->query;
  options.threads = 1;
  return QueryWith(a, b, options, of_body);
}

void SceneCandidates::Start(const SceneSearch& scene, uint32_t a) {
  HULLD_DCHECK(a < scene.size());
  scene_ = &scene;
  a_ = a;
  first_ = scene.FirstCandidate(a);
  const double clearance = scene.options_->query.clearance.value_or(0);
  if (scene.moving_.empty()) {
    box_ = GrownBy(scene.boxes_[a], clearance);
    cursor_ = scene.tree_.Begin();
  } else {
    const auto& [start, end] = scene.moving_[a];
    moving_ = {GrownBy(start, clearance), GrownBy(end, clearance)};
    waiting_.clear();
    if (!scene.tree_.empty()) waiting_.push_back(0);
  }
  is_gathered_ = false;
  listed_.clear();
  marked_.clear();
  is_marked_ = false;
  next_ = 0;
}

bool SceneCandidates::AppendMeeting(uint64_t nodes) {
  const size_t before = listed_.size();
  const uint32_t tree_first = scene_->tree_first_;
  const bool is_done =
      scene_->tree_.AppendMeeting(box_, first_ - tree_first, nodes, cursor_, listed_);
  for (size_t i = before; i < listed_.size(); ++i) listed_[i] += tree_first;
  return is_done;
}

bool SceneCandidates::AppendMeetingInMotion(uint64_t nodes) {
  const BoxTree& tree = scene_->tree_;
  for (; !waiting_.empty() && nodes > 0; --nodes) {
    const uint32_t node = waiting_.back();
    waiting_.pop_back();
    // At each time, the boxes of a subtree are within the box around its motions.
    if (!MayMeet(moving_, {tree.box(node), tree.box(node)})) continue;
    if (!tree.is_leaf(node)) {
      const auto [left, right] = tree.children(node);
      waiting_.push_back(right);
      waiting_.push_back(left);
      continue;
    }
    for (const uint32_t index : tree.indices(node)) {
      const uint32_t b = index + scene_->tree_first_;
      if (b >= first_ && MayMeet(moving_, scene_->moving_[b])) listed_.push_back(b);
    }
  }
  return waiting_.empty();
}

bool SceneCandidates::Gather(uint64_t nodes) {
  if (is_gathered_) return true;
  const size_t before = listed_.size();
  is_gathered_ = scene_->moving_.empty() ? AppendMeeting(nodes) : AppendMeetingInMotion(nodes);
  const auto is_ignored = [this](uint32_t b) { return scene_->IsIgnored(a_, b); };
  listed_.erase(
      std::remove_if(listed_.begin() + static_cast<ptrdiff_t>(before), listed_.end(), is_ignored),
      listed_.end());
  if (listed_.size() > kMaxListed && !is_marked_) {
    marked_.assign(scene_->placements_.size() / kWordBits + 1, 0);
    is_marked_ = true;
  }
  if (is_marked_) {
    for (const uint32_t b : listed_) marked_[b / kWordBits] |= uint64_t{1} << b % kWordBits;
    listed_.clear();
  } else if (is_gathered_) {
    std::sort(listed_.begin(), listed_.end());
  }
  return is_gathered_;
}

std::optional<uint32_t> SceneCandidates::Next() {
  HULLD_DCHECK(is_gathered_);
  if (!is_marked_) {
    if (next_ == listed_.size()) return std::nullopt;
    return listed_[next_++];
  }
  while (next_ < marked_.size() && marked_[next_] == 0) ++next_;
  if (next_ == marked_.size()) return std::nullopt;
  uint64_t& word = marked_[next_];
  const auto bit = static_cast<uint64_t>(std::countr_zero(word));
  word &= word - 1;
  return static_cast<uint32_t>(next_ * kWordBits + bit);
}

absl::StatusOr<SceneTotals> FindCollisions(
    std::span<const PlacedHull> placements, const SceneOptions& options,
    const std::function<void(std::span<const SceneAnswer>)>& emit) {
  const absl::StatusOr<SceneSearch> scene = SceneSearch::Make(placements, options);
  if (!scene.ok()) return scene.status();
  return Search(*scene, options).Run(emit);
}

}  // namespace hulld
