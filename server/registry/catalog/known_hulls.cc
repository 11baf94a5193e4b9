#include "server/registry/catalog/known_hulls.h"

#include <absl/status/status.h>

#include <utility>

#include "core/base/check.h"

namespace hulld::server {

// Hulls are numbered by their first occurrence: neighbors in a request were mostly created
// together, so a store has them in one place.
void KnownHulls::Begin(std::span<const std::string> ids) {
  HULLD_CHECK(!has_begun_ || hull_of_.size() == ids.size());
  if (std::exchange(has_begun_, true)) return;
  hulls_.reserve(ids.size());
  hull_of_.reserve(ids.size());
  by_hash_.reserve(ids.size());
  for (uint32_t i = 0; i < ids.size(); ++i) {
    const auto next = static_cast<uint32_t>(hulls_.size());
    uint32_t* hull = &by_hash_.try_emplace(RecentChanges::HashOf(ids[i]), next).first->second;
    while (*hull != next && *hull != kNone && ids[hulls_[*hull].first] != ids[i]) {
      hull = &hulls_[*hull].same_hash;
    }
    if (*hull == kNone) *hull = next;
    hull_of_.push_back(*hull);
    if (*hull == next) hulls_.emplace_back().first = i;
  }
  ForgetAll();
}

// In reverse, so that the first hull is processed first.
void KnownHulls::ForgetAll() {
  for (size_t k = hulls_.size(); k-- > 0;) MakeDue(static_cast<uint32_t>(k));
}

void KnownHulls::NoteChange(uint64_t hash) {
  const auto changed = by_hash_.find(hash);
  if (changed == by_hash_.end()) return;
  for (uint32_t k = changed->second; k != kNone; k = hulls_[k].same_hash) MakeDue(k);
}

void KnownHulls::MakeDue(uint32_t hull) {
  if (!std::exchange(hulls_[hull].is_due, true)) due_.push_back(hull);
}

void KnownHulls::BeginLookup() {
  for (uint32_t k = 0; k < hulls_.size(); ++k) {
    hulls_[k].is_prepared = false;
    const absl::Status& status = hulls_[k].view.status();
    const bool is_final = status.ok() || absl::IsNotFound(status) || absl::IsDataLoss(status);
    if (!is_final) MakeDue(k);
  }
}

uint64_t KnownHulls::HullBytes() const {
  uint64_t bytes = 0;
  for (const Known& known : hulls_) bytes += known.view.ok() ? known.bytes : 0;
  return bytes;
}

std::vector<absl::StatusOr<HullView>> KnownHulls::Views(std::span<const std::string> ids) {
  HULLD_CHECK(ids.size() == hull_of_.size());
  std::vector<absl::StatusOr<HullView>> views;
  views.reserve(ids.size());
  const bool takes = is_for_one_lookup_ && hulls_.size() == ids.size();
  for (const uint32_t hull : hull_of_) {
    absl::StatusOr<HullView>& view = hulls_[hull].view;
    views.push_back(takes ? std::move(view) : view);
  }
  return views;
}

}  // namespace hulld::server
