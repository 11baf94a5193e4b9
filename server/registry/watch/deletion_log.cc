#include "server/registry/watch/deletion_log.h"

#include <algorithm>

namespace hulld::server {

void DeletionLog::Add(const std::string& id, uint64_t revision, bool was_body) {
  log_.push_back({revision, id, was_body});
  Last last{revision, was_body ? 0 : revision};
  if (const auto former = last_.find(id); former != last_.end()) {
    if (was_body) last.hull_revision = former->second.hull_revision;
    // The new key outlives the former one.
    last_.erase(former);
  }
  last_.emplace(log_.back().id, last);
  if (log_.size() <= kCapacity) return;
  begin_ = log_.front().revision;
  const auto first = last_.find(log_.front().id);
  if (first != last_.end() && first->second.revision == begin_) last_.erase(first);
  log_.pop_front();
}

void DeletionLog::NoteCreation(const std::string& id, bool is_body) {
  const auto last = last_.find(id);
  if (last == last_.end()) return;
  if (is_body) {
    last->second.is_body_now = true;
  } else {
    last_.erase(last);
  }
}

std::deque<DeletionLog::Deletion>::const_iterator DeletionLog::After(uint64_t revision) const {
  return std::ranges::upper_bound(log_, revision, {}, &Deletion::revision);
}

bool DeletionLog::IsFinal(const Deletion& deletion, bool bodies) const {
  const auto last = last_.find(deletion.id);
  if (last == last_.end()) return false;
  if (!bodies) return deletion.revision == last->second.hull_revision;
  return deletion.revision == last->second.revision && !last->second.is_body_now;
}

}  // namespace hulld::server
