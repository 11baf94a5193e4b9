#include "server/registry/hull_table.h"

#include "core/base/check.h"
#include "server/registry/registered_hull.h"

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
  record.dimension = dimension;
  record.vertex_count = vertex_count;
  record.counts = counts;
  return record;
}

bool HullTable::Entry::visible() const { return awake_ == nullptr || awake_->state.visible(); }

uint64_t HullTable::Entry::revision() const {
  return awake_ == nullptr ? resting_.revision : awake_->committed.record.revision;
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

bool HullTable::IsVisible(const std::string& id) const {
  const auto found = entries_.find(id);
  return found != entries_.end() && found->second.visible();
}

HullTable::HullPointer HullTable::Find(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return nullptr;
  Entry& entry = found->second;
  if (entry.awake_ == nullptr) {
    const RestingHull& resting = entry.resting_;
    const StoredHull stored = {resting.RecordWith(id), resting.writer_count, resting.layout};
    entry.awake_ =
        std::make_shared<RegisteredHull>(stored, HullState::Present(), readable_, budget_);
    entry.awake_->has_box = resting.has_box;
    entry.awake_->low = resting.low;
    entry.awake_->high = resting.high;
  }
  return entry.awake_;
}

void HullTable::AddResting(const StoredHull& stored) {
  const auto [place, is_new] = entries_.try_emplace(stored.record.hull_id);
  HULLD_CHECK(is_new);
  place->second.resting_ = RestingHull(stored);
  ++held_;
}

HullTable::HullPointer HullTable::Insert(const StoredHull& stored, const HullState& state) {
  auto hull = std::make_shared<RegisteredHull>(stored, state, readable_, budget_);
  Insert(hull);
  return hull;
}

void HullTable::Insert(const HullPointer& hull) {
  const auto [place, is_new] = entries_.try_emplace(hull->committed.record.hull_id);
  HULLD_CHECK(is_new);
  place->second.awake_ = hull;
  ++held_;
}

void HullTable::Erase(const HullPointer& hull) {
  const auto found = entries_.find(hull->committed.record.hull_id);
  HULLD_CHECK(found != entries_.end() && found->second.awake_ == hull);
  entries_.erase(found);
  --held_;
}

// Whether nothing would be lost with it but what its record says.
bool HullTable::IsUnused(const HullPointer& hull) const {
  const RegisteredHull& h = *hull;
  return hull.use_count() == 1 && h.state.life() == HullState::Life::kPresent && h.state.quiet() &&
         !h.state.damaged() && h.live == nullptr && h.builder == nullptr &&
         h.canonical == nullptr && !h.loading && !h.preparing && h.writers.empty() &&
         h.sequence_readers == 0 && h.watches.empty() && h.chunks.empty() && h.exclusive.empty();
}

void HullTable::RestSome() {
  auto next = entries_.upper_bound(hand_);
  for (int i = 0; i < kHullsPerStep; ++i, ++next) {
    if (next == entries_.end()) {
      hand_.clear();
      return;
    }
    if (i + 1 == kHullsPerStep) hand_ = next->first;
    Entry& entry = next->second;
    if (entry.awake_ == nullptr || !IsUnused(entry.awake_)) continue;
    RestingHull resting(entry.awake_->committed);
    resting.has_box = entry.awake_->has_box;
    resting.low = entry.awake_->low;
    resting.high = entry.awake_->high;
    entry.resting_ = resting;
    entry.awake_ = nullptr;
  }
}

}  // namespace hulld::server
