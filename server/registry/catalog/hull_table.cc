#include "server/registry/catalog/hull_table.h"

#include <utility>

#include "core/base/check.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {

HullTable::RestingHull::RestingHull(const StoredHull& stored)
    : create_revision(stored.record.create_revision),
      revision(stored.record.revision),
      vertex_count(stored.record.vertex_count),
      counts(stored.record.counts),
      writer_count(stored.writer_count),
      layout(stored.layout),
      dimension(static_cast<int8_t>(stored.record.dimension)) {}

HullRecord HullTable::RestingHull::RecordWith(const std::string& id) const {
  HullRecord record;
  record.hull_id = id;
  record.create_revision = create_revision;
  record.revision = revision;
  // NOLINTNEXTLINE(bugprone-signed-char-misuse): -1 is that of no points
  record.dimension = dimension;
  record.vertex_count = vertex_count;
  record.counts = counts;
  return record;
}

bool HullTable::Entry::visible() const {
  return !is_absent_ && (awake_ == nullptr || awake_->state.visible());
}

uint64_t HullTable::Entry::revision() const {
  return awake_ == nullptr ? resting_.revision : awake_->committed().record.revision;
}

HullChange HullTable::Entry::Describe(const std::string& id) const {
  if (awake_ != nullptr) return awake_->Describe();
  HullChange change;
  change.record = resting_.RecordWith(id);
  change.has_box = resting_.has_box;
  change.low = resting_.low;
  change.high = resting_.high;
  return change;
}

bool HullTable::contains(const std::string& id) const {
  const auto found = entries_.find(id);
  return found != entries_.end() && !found->second.is_absent_;
}

bool HullTable::IsVisible(const std::string& id) const {
  const auto found = entries_.find(id);
  return found != entries_.end() && found->second.visible();
}

std::optional<HullTable::HullPointer> HullTable::Ask(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end())
    return is_cache() ? std::nullopt : std::optional<HullPointer>(nullptr);
  Entry& entry = found->second;
  entry.is_used_ = true;
  if (entry.is_absent_) return nullptr;
  if (entry.awake_ == nullptr) {
    const RestingHull& resting = entry.resting_;
    const StoredHull stored = {resting.RecordWith(id), resting.writer_count, resting.layout};
    entry.awake_ =
        std::make_shared<RegisteredHull>(stored, HullState::Present(), readable_, budget_);
    if (resting.has_box) entry.awake_->SetBox(resting.low, resting.high);
  }
  return entry.awake_;
}

// Requires: no hull has the ID. Its absence may be known.
HullTable::Entry& HullTable::Add(const std::string& id) {
  const auto [place, is_new] = entries_.try_emplace(id);
  HULLD_CHECK(is_new || place->second.is_absent_);
  place->second.is_absent_ = false;
  ++size_;
  return place->second;
}

void HullTable::AddResting(const StoredHull& stored) {
  Add(stored.record.hull_id).resting_ = RestingHull(stored);
}

void HullTable::NoteAbsent(const std::string& id) {
  HULLD_CHECK(is_cache());
  const auto [place, is_new] = entries_.try_emplace(id);
  HULLD_CHECK(is_new || place->second.is_absent_);
  place->second.is_absent_ = true;
}

void HullTable::ForgetAbsent(const std::string& id) {
  const auto found = entries_.find(id);
  if (found != entries_.end() && found->second.is_absent_) entries_.erase(found);
}

HullTable::HullPointer HullTable::Insert(const StoredHull& stored, const HullState& state) {
  auto hull = std::make_shared<RegisteredHull>(stored, state, readable_, budget_);
  Insert(hull);
  return hull;
}

void HullTable::Insert(const HullPointer& hull) {
  Add(hull->committed().record.hull_id).awake_ = hull;
}

void HullTable::Erase(const HullPointer& hull) {
  const auto found = entries_.find(hull->committed().record.hull_id);
  HULLD_CHECK(found != entries_.end() && found->second.awake_ == hull);
  --size_;
  if (!is_cache()) {
    entries_.erase(found);
    return;
  }
  found->second = {};
  found->second.is_absent_ = true;
}

// True if the record alone can restore the hull.
bool HullTable::IsUnused(const HullPointer& hull) const {
  return hull.use_count() == 1 && hull->IsAtRest();
}

void HullTable::RestSome() {
  auto next = entries_.upper_bound(hand_);
  for (int i = 0; i < kHullsPerStep; ++i) {
    if (next == entries_.end()) {
      hand_.clear();
      return;
    }
    if (i + 1 == kHullsPerStep) hand_ = next->first;
    const auto looked_at = next++;
    Entry& entry = looked_at->second;
    if (entry.awake_ != nullptr) {
      if (!IsUnused(entry.awake_)) continue;
      RestingHull resting(entry.awake_->committed());
      const HullChange described = entry.awake_->Describe();
      resting.has_box = described.has_box;
      resting.low = described.low;
      resting.high = described.high;
      entry.resting_ = resting;
      entry.awake_ = nullptr;
    }
    if (!is_cache() || entries_.size() <= *most_ || std::exchange(entry.is_used_, false)) continue;
    if (!entry.is_absent_) --size_;
    entries_.erase(looked_at);
  }
}

}  // namespace hulld::server
