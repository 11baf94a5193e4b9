#include "server/collisions/placed/live_pairs.h"

#include <algorithm>
#include <optional>

#include "core/base/status_macros.h"
#include "server/collisions/placed/query_settings.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

// Up to this many placements are compared with all others; for more, a tree costs less.
constexpr size_t kMaxCompared = 16;

uint64_t KeyOf(uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; }

}  // namespace

LivePairs::LivePairs(const google::protobuf::RepeatedField<uint32_t>& pairs, size_t placements,
                     v1::Relation relation)
    : first_relation_(relation), pairs_of_(placements) {
  pairs_.reserve(static_cast<size_t>(pairs.size()) / 2);
  for (int i = 0; i < pairs.size(); i += 2) Add(pairs[i], pairs[i + 1]);
}

LivePairs::LivePairs(const v1::CollisionWatchOpen& open, size_t placements, uint64_t max_pairs)
    : LivePairs(open.pairs(), placements, v1::RELATION_SEPARATED) {
  is_scene_ = open.pairs().empty();
  max_pairs_ = max_pairs;
  groups_.assign(open.groups().begin(), open.groups().end());
  movers_ = open.has_movers() ? open.movers() : static_cast<uint32_t>(placements);
  clearance_ = open.clearance();
  for (const GroupPair& pair : IgnoredGroups(open)) {
    ignored_.insert(std::minmax(pair.first, pair.second));
  }
  if (is_scene_) boxes_.resize(placements);
}

uint32_t LivePairs::Add(uint32_t a, uint32_t b) {
  auto number = static_cast<uint32_t>(pairs_.size());
  if (free_.empty()) {
    pairs_.emplace_back();
  } else {
    number = free_.back();
    free_.pop_back();
  }
  pairs_[number] = {.a = a, .b = b, .relation = first_relation_};
  pairs_of_[a].push_back(number);
  if (a != b) pairs_of_[b].push_back(number);
  return number;
}

void LivePairs::Drop(uint32_t number) {
  const LivePair& pair = pairs_[number];
  numbers_.erase(KeyOf(pair.a, pair.b));
  std::erase(pairs_of_[pair.a], number);
  std::erase(pairs_of_[pair.b], number);
  free_.push_back(number);
}

bool LivePairs::MayCollide(uint32_t a, uint32_t b) const {
  if (a == b || std::min(a, b) >= movers_) return false;
  if (groups_.empty() || ignored_.empty()) return true;
  return !ignored_.contains(std::minmax(groups_[a], groups_[b]));
}

void LivePairs::SelectOne(uint32_t number) {
  if (std::exchange(pairs_[number].is_selected, true)) return;
  selected_.push_back(number);
}

void LivePairs::SelectAll() {
  for (uint32_t number = 0; number < pairs_.size(); ++number) SelectOne(number);
}

void LivePairs::SelectPairsOf(uint32_t placement) {
  for (const uint32_t number : pairs_of_[placement]) SelectOne(number);
}

void LivePairs::SortSelected() {
  if (!std::ranges::is_sorted(selected_)) std::ranges::sort(selected_);
}

absl::Status LivePairs::Select(std::span<const uint32_t> changed, const PlacementTable& table) {
  for (const uint32_t placement : changed) {
    SelectPairsOf(placement);
    if (is_scene_) boxes_[placement] = table.BoxOf(placement);
  }
  return is_scene_ ? SelectNeighbors(changed) : absl::OkStatus();
}

absl::Status LivePairs::SelectNeighbors(std::span<const uint32_t> changed) {
  std::optional<BoxTree> tree;
  if (changed.size() > kMaxCompared) tree.emplace(boxes_);
  std::vector<uint32_t> met;
  for (const uint32_t a : changed) {
    const Box box = GrownBy(boxes_[a], clearance_);
    met.clear();
    if (tree.has_value()) tree->AppendMeeting(box, 0, met);
    for (uint32_t b = 0; !tree.has_value() && b < boxes_.size(); ++b) {
      if (box.Meets(boxes_[b])) met.push_back(b);
    }
    for (const uint32_t b : met) {
      HULLD_RETURN_IF_ERROR(SelectPair(a, b));
    }
  }
  return absl::OkStatus();
}

absl::Status LivePairs::SelectPair(uint32_t a, uint32_t b) {
  if (!MayCollide(a, b)) return absl::OkStatus();
  const auto [low, high] = std::minmax(a, b);
  const auto [place, is_new] = numbers_.emplace(KeyOf(low, high), 0);
  if (is_new) {
    if (numbers_.size() > max_pairs_) {
      return LimitExceeded("too many pairs of the scene have intersecting bounding boxes",
                           max_pairs_, "max-pairs-per-batch");
    }
    place->second = Add(low, high);
  }
  SelectOne(place->second);
  return absl::OkStatus();
}

void LivePairs::ForgetPoints(uint32_t placement) {
  for (const uint32_t number : pairs_of_[placement]) pairs_[number].cache.ForgetHulls();
}

void LivePairs::EndRound() {
  for (const uint32_t number : selected_) {
    LivePair& pair = pairs_[number];
    pair.is_selected = false;
    if (!is_scene_ || pair.is_reported()) continue;
    if (!GrownBy(boxes_[pair.a], clearance_).Meets(boxes_[pair.b])) Drop(number);
  }
  selected_.clear();
}

size_t LivePairs::BytesOf(size_t pairs, size_t placements) {
  // Entries in the lists of two placements, and in the selection.
  return pairs * (sizeof(LivePair) + 3 * sizeof(uint32_t)) +
         placements * (sizeof(std::vector<uint32_t>) + sizeof(uint32_t));
}

size_t LivePairs::MemoryBytes() const {
  // A node of the map by key.
  constexpr size_t kNodeBytes = 48;
  return BytesOf(pairs_.size(), pairs_of_.size()) + pairs_.size() * kNodeBytes +
         boxes_.size() * sizeof(Box);
}

}  // namespace hulld::server
