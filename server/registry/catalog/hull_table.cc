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
  // NOLINTNEXTLINE(bugprone-signed-char-misuse): -1 stands for no points
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
  change.box = resting_.box;
  return change;
}

HullTable::HullTable(bool readable, MemoryBudget& budget)
    : readable_(readable), budget_(budget), compact_account_(budget, [this](Locked& /*locked*/) {
        if (readable_) DropCompact();
      }) {}

std::pair<HullTable::Place, bool> HullTable::AddEntry(const std::string& id) {
  if (const auto found = index_.find(id); found != index_.end()) return {*found, false};
  const Place place = entries_.try_emplace(id).first;
  index_.insert(place);
  return {place, true};
}

void HullTable::EraseEntry(Place place) {
  ExchangeCompact(place->second, nullptr);
  index_.erase(place);
  entries_.erase(place);
}

bool HullTable::contains(const std::string& id) const {
  const auto found = index_.find(id);
  return found != index_.end() && !(*found)->second.is_absent_;
}

std::optional<HullPointer> HullTable::LookUp(const std::string& id) {
  const auto found = index_.find(id);
  if (found == index_.end()) return is_cache() ? std::nullopt : std::optional<HullPointer>(nullptr);
  Entry& entry = (*found)->second;
  passes_since_use_ = 0;
  entry.is_used_ = true;
  entry.is_idle_ = false;
  if (entry.is_absent_) return nullptr;
  if (entry.awake_ == nullptr) Wake(id, entry);
  return entry.awake_;
}

void HullTable::Wake(const std::string& id, Entry& entry) {
  const RestingHull& resting = entry.resting_;
  const StoredHull stored = {resting.RecordWith(id), resting.writer_count, resting.layout};
  entry.awake_ = std::make_shared<RegisteredHull>(stored, HullState::Present(), readable_, budget_);
  entry.awake_->SetBox(resting.box);
  if (resting.compact != nullptr) entry.awake_->Restore(*resting.compact);
}

// Sets the points of a hull at rest, counts them, and returns the previous ones. Under memory
// pressure they are evicted first: the hulls of the other accounts were used since.
std::unique_ptr<CompactHull> HullTable::ExchangeCompact(Entry& entry,
                                                        std::unique_ptr<CompactHull> compact) {
  std::unique_ptr<CompactHull>& kept = entry.resting_.compact;
  if (kept == nullptr && compact == nullptr) return nullptr;
  if (kept != nullptr) compact_bytes_ -= kept->MemoryBytes();
  if (compact != nullptr) compact_bytes_ += compact->MemoryBytes();
  std::swap(kept, compact);
  compact_account_.Set(compact_bytes_, !readable_);
  compact_account_.Age();
  return compact;
}

// Drops the points of some hulls at rest, which the store can read back.
void HullTable::DropCompact() {
  constexpr int kMaxVisited = 128;
  auto next = entries_.upper_bound(compact_hand_);
  for (int i = 0; i < kMaxVisited && next != entries_.end(); ++i) {
    compact_hand_ = next->first;
    ExchangeCompact(next++->second, nullptr);
  }
  if (next == entries_.end()) compact_hand_.clear();
}

// Requires: no hull has the ID. Its absence may be known.
HullTable::Entry& HullTable::Add(const std::string& id) {
  const auto [place, is_new] = AddEntry(id);
  HULLD_CHECK(is_new || place->second.is_absent_);
  place->second.is_absent_ = false;
  return place->second;
}

void HullTable::AddResting(const StoredHull& stored) {
  Add(stored.record.hull_id).resting_ = RestingHull(stored);
}

void HullTable::NoteAbsent(const std::string& id) {
  HULLD_CHECK(is_cache());
  const auto [place, is_new] = AddEntry(id);
  HULLD_CHECK(is_new || place->second.is_absent_);
  place->second.is_absent_ = true;
}

void HullTable::ForgetAbsent(const std::string& id) {
  const auto found = index_.find(id);
  if (found != index_.end() && (*found)->second.is_absent_) EraseEntry(*found);
}

HullPointer HullTable::Insert(const StoredHull& stored, const HullState& state) {
  auto hull = std::make_shared<RegisteredHull>(stored, state, readable_, budget_);
  Insert(hull);
  return hull;
}

void HullTable::Insert(const HullPointer& hull) {
  passes_since_use_ = 0;
  Add(hull->committed().record.hull_id).awake_ = hull;
}

void HullTable::Erase(const HullPointer& hull) {
  const auto found = index_.find(hull->committed().record.hull_id);
  HULLD_CHECK(found != index_.end() && (*found)->second.awake_ == hull);
  if (!is_cache()) return EraseEntry(*found);
  Entry& entry = (*found)->second;
  ExchangeCompact(entry, nullptr);
  entry = {};
  entry.is_absent_ = true;
}

// Puts a hull to rest with its points if it is small and unused. Otherwise returns false.
bool HullTable::RestCompact(Locked& locked, Entry& entry) {
  std::unique_ptr<CompactHull> compact =
      entry.awake_.use_count() > 1 ? nullptr : entry.awake_->Compact();
  if (compact == nullptr) return false;
  // The points of an unchanged hull stay in place: copies would be scattered over the pages that
  // its other structures vacate.
  const RestingHull& previous = entry.resting_;
  const HullRecord& record = entry.awake_->committed().record;
  const bool is_unchanged = previous.compact != nullptr && previous.revision == record.revision &&
                            previous.create_revision == record.create_revision &&
                            previous.compact->writers == compact->writers;
  if (is_unchanged) compact = ExchangeCompact(entry, nullptr);
  if (compact->points.empty() && compact->writers.empty()) compact = nullptr;
  ExchangeCompact(entry, nullptr);
  entry.resting_ = RestingHull(entry.awake_->committed());
  entry.resting_.box = entry.awake_->Describe().box;
  entry.awake_->account.Close();
  locked.Discard(std::exchange(entry.awake_, nullptr));
  ExchangeCompact(entry, std::move(compact));
  return true;
}

void HullTable::RestSoon(Locked& locked, const RegisteredHull& hull) {
  const std::string& id = hull.committed().record.hull_id;
  const auto changed = index_.find(id);
  if (changed == index_.end() || !hull.is_small()) return;
  (*changed)->second.is_idle_ = true;
  just_changed_.push_back(id);
  for (int i = 0; i < 2 && just_changed_.size() > kMaxJustChanged; ++i) {
    const auto found = index_.find(just_changed_.front());
    just_changed_.pop_front();
    if (found == index_.end()) continue;
    Entry& entry = (*found)->second;
    if (entry.is_idle_ && entry.awake_ != nullptr) RestCompact(locked, entry);
  }
}

bool HullTable::RestIdle(Locked& locked, std::string& cursor) {
  // Fewer than lookups, because putting a hull to rest copies its points.
  constexpr uint64_t kMaxRested = kMaxLookupsPerHold / 4;
  uint64_t rested = 0;
  if (cursor.empty() && passes_since_use_++ >= 2) return false;
  auto next = entries_.upper_bound(cursor);
  for (uint64_t visited = 0; visited < kMaxLookupsPerHold && rested < kMaxRested; ++visited) {
    if (next == entries_.end()) return false;
    cursor = next->first;
    Entry& entry = next++->second;
    locked.NoteLookup();
    const bool was_idle = std::exchange(entry.is_idle_, true);
    if (!was_idle || entry.awake_ == nullptr) continue;
    if (RestCompact(locked, entry)) {
      ++rested;
    } else if (entry.awake_->is_small()) {
      // In use now, but perhaps not at the next pass.
      passes_since_use_ = 0;
    }
  }
  return true;
}

void HullTable::RestSome(Locked& locked) {
  auto next = entries_.upper_bound(hand_);
  for (int i = 0; i < kHullsPerStep; ++i) {
    if (next == entries_.end()) {
      hand_.clear();
      return;
    }
    if (i + 1 == kHullsPerStep) hand_ = next->first;
    const auto visited = next++;
    Entry& entry = visited->second;
    if (entry.awake_ != nullptr) {
      if (!entry.awake_->IsAtRest() || !RestCompact(locked, entry)) continue;
    }
    if (!is_cache() || entries_.size() <= *capacity_ || std::exchange(entry.is_used_, false)) {
      continue;
    }
    EraseEntry(visited);
  }
}

}  // namespace hulld::server
