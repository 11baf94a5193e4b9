#include "server/collisions/watch/watched_pairs.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/collisions/placed/scene_groups.h"
#include "server/contract/limit_error.h"

namespace hulld::server {
namespace {

// Up to this many placements are compared with all others; beyond it, a tree costs less.
constexpr size_t kMostCompared = 16;

uint64_t KeyOf(uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; }

}  // namespace

WatchedPairs::WatchedPairs(const v1::CollisionWatchOpen& open, size_t placements,
                           uint64_t max_pairs)
    : pairs_of_(placements),
      is_scene_(open.pairs().empty()),
      max_pairs_(max_pairs),
      groups_(open.groups().begin(), open.groups().end()),
      movers_(open.has_movers() ? open.movers() : static_cast<uint32_t>(placements)),
      clearance_(open.clearance()) {
  for (const GroupPair& pair : IgnoredGroups(open)) {
    ignored_.insert(std::minmax(pair.first, pair.second));
  }
  if (is_scene_) boxes_.resize(placements);
  pairs_.reserve(static_cast<size_t>(open.pairs_size()) / 2);
  for (int i = 0; i < open.pairs_size(); i += 2) Add(open.pairs(i), open.pairs(i + 1));
}

uint32_t WatchedPairs::Add(uint32_t a, uint32_t b) {
  auto number = static_cast<uint32_t>(pairs_.size());
  if (free_.empty()) {
    pairs_.emplace_back();
  } else {
    number = free_.back();
    free_.pop_back();
    pairs_[number] = {};
  }
  pairs_[number].a = a;
  pairs_[number].b = b;
  pairs_of_[a].push_back(number);
  if (a != b) pairs_of_[b].push_back(number);
  return number;
}

void WatchedPairs::Drop(uint32_t number) {
  const WatchedPair& pair = pairs_[number];
  numbers_.erase(KeyOf(pair.a, pair.b));
  std::erase(pairs_of_[pair.a], number);
  std::erase(pairs_of_[pair.b], number);
  free_.push_back(number);
}

bool WatchedPairs::MayCollide(uint32_t a, uint32_t b) const {
  if (a == b || std::min(a, b) >= movers_) return false;
  if (groups_.empty() || ignored_.empty()) return true;
  return !ignored_.contains(std::minmax(groups_[a], groups_[b]));
}

void WatchedPairs::SelectOne(uint32_t number) {
  if (std::exchange(pairs_[number].is_selected, true)) return;
  selected_.push_back(number);
}

absl::Status WatchedPairs::Select(std::span<const uint32_t> changed, const PlacementTable& table) {
  for (const uint32_t placement : changed) {
    for (const uint32_t number : pairs_of_[placement]) SelectOne(number);
    if (is_scene_) boxes_[placement] = table.BoxOf(placement);
  }
  return is_scene_ ? SelectNeighbors(changed) : absl::OkStatus();
}

absl::Status WatchedPairs::SelectNeighbors(std::span<const uint32_t> changed) {
  if (changed.size() <= kMostCompared) {
    for (const uint32_t a : changed) {
      const Box box = GrownBy(boxes_[a], clearance_);
      for (uint32_t b = 0; b < boxes_.size(); ++b) {
        if (!box.Meets(boxes_[b])) continue;
        if (absl::Status s = SelectPair(a, b); !s.ok()) return s;
      }
    }
    return absl::OkStatus();
  }
  const BoxTree tree(boxes_);
  std::vector<uint32_t> met;
  for (const uint32_t a : changed) {
    met.clear();
    tree.AppendMeeting(GrownBy(boxes_[a], clearance_), 0, met);
    for (const uint32_t b : met) {
      if (absl::Status s = SelectPair(a, b); !s.ok()) return s;
    }
  }
  return absl::OkStatus();
}

absl::Status WatchedPairs::SelectPair(uint32_t a, uint32_t b) {
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

void WatchedPairs::ForgetPoints(uint32_t placement) {
  for (const uint32_t number : pairs_of_[placement]) pairs_[number].cache.ForgetHulls();
}

void WatchedPairs::EndRound() {
  for (const uint32_t number : selected_) {
    WatchedPair& pair = pairs_[number];
    pair.is_selected = false;
    if (!is_scene_ || pair.is_reported()) continue;
    if (!GrownBy(boxes_[pair.a], clearance_).Meets(boxes_[pair.b])) Drop(number);
  }
  selected_.clear();
}

size_t WatchedPairs::MemoryBytes() const {
  // Entries in the lists of two placements, in the selection, and in the map by key.
  constexpr size_t kPerPair = sizeof(WatchedPair) + 3 * sizeof(uint32_t) + 48;
  return pairs_.size() * kPerPair +
         pairs_of_.size() * (sizeof(std::vector<uint32_t>) + sizeof(uint32_t)) +
         boxes_.size() * sizeof(Box);
}

}  // namespace hulld::server
