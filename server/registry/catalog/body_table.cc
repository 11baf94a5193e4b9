#include "server/registry/catalog/body_table.h"

#include <utility>

#include "core/base/check.h"

namespace hulld::server {

uint64_t BodyTable::BytesOf(const Entry& entry) {
  return kBytesOfEntry + (entry.body_ == nullptr ? 0 : entry.body_->stored()->MemoryBytes());
}

BodyTable::Entry* BodyTable::Find(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return nullptr;
  used_.splice(used_.begin(), used_, found->second.place_);
  return &found->second;
}

BodyTable::Entry& BodyTable::Add(const std::string& id) {
  const auto [place, is_new] = entries_.try_emplace(id);
  Entry& entry = place->second;
  if (is_new) {
    used_.push_front(&place->first);
    entry.place_ = used_.begin();
    bytes_ += BytesOf(entry);
  }
  return entry;
}

void BodyTable::Set(Locked& locked, const std::string& id, std::shared_ptr<const Body> body) {
  Entry* const entry = Find(id);
  HULLD_CHECK(entry != nullptr);
  bytes_ -= BytesOf(*entry);
  locked.Discard(std::exchange(entry->body_, std::move(body)));
  bytes_ += BytesOf(*entry);
}

void BodyTable::Erase(Locked& locked, const std::string& id) {
  const auto found = entries_.find(id);
  HULLD_CHECK(found != entries_.end() && !found->second.in_flight && found->second.waiting.empty());
  bytes_ -= BytesOf(found->second);
  used_.erase(found->second.place_);
  locked.Discard(std::move(found->second.body_));
  entries_.erase(found);
}

void BodyTable::DropSome(Locked& locked) {
  if (!most_.has_value()) return;
  int skipped = 0;
  while (bytes_ > *most_ && skipped < kMaxSkipped && !used_.empty()) {
    const std::string id = *used_.back();
    if (entries_.at(id).IsUnused()) {
      Erase(locked, id);
    } else {
      ++skipped;
      used_.splice(used_.begin(), used_, std::prev(used_.end()));
    }
  }
}

}  // namespace hulld::server
