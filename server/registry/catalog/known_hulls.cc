#include "server/registry/catalog/known_hulls.h"

#include <absl/status/status.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {

// Equal IDs have equal hashes, so sorting by hash groups them. Hulls are numbered by their first
// occurrence: neighbors in a request were mostly created together, so a store has them in one
// place.
void KnownHulls::Begin(std::span<const std::string> ids) {
  HULLD_CHECK(!has_begun_ || hull_of_.size() == ids.size());
  if (std::exchange(has_begun_, true)) return;
  std::vector<std::pair<uint64_t, uint32_t>> order;
  order.reserve(ids.size());
  for (uint32_t i = 0; i < ids.size(); ++i) order.emplace_back(RecentChanges::HashOf(ids[i]), i);
  std::ranges::sort(order, [&](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    const int compared = ids[a.second].compare(ids[b.second]);
    return compared != 0 ? compared < 0 : a.second < b.second;
  });
  // Maps each occurrence to the index of the ID's first occurrence.
  hull_of_.resize(ids.size());
  for (size_t n = 0; n < order.size(); ++n) {
    const auto [hash, i] = order[n];
    const bool is_new = n == 0 || order[n - 1].first != hash || ids[order[n - 1].second] != ids[i];
    hull_of_[i] = is_new ? i : hull_of_[order[n - 1].second];
    if (is_new) by_hash_.emplace_back(hash, i);
  }
  hulls_.reserve(by_hash_.size());
  for (uint32_t i = 0; i < ids.size(); ++i) {
    const bool is_first = hull_of_[i] == i;
    if (is_first) hulls_.emplace_back().first = i;
    hull_of_[i] = is_first ? static_cast<uint32_t>(hulls_.size() - 1) : hull_of_[hull_of_[i]];
  }
  for (auto& [hash, hull] : by_hash_) hull = hull_of_[hull];
  ForgetAll();
}

// In reverse, so that the first hull is processed first.
void KnownHulls::ForgetAll() {
  for (size_t k = hulls_.size(); k-- > 0;) MakeDue(static_cast<uint32_t>(k));
}

void KnownHulls::NoteChange(uint64_t hash) {
  auto changed = std::ranges::lower_bound(by_hash_, std::pair(hash, uint32_t{0}));
  for (; changed != by_hash_.end() && changed->first == hash; ++changed) MakeDue(changed->second);
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

std::vector<absl::StatusOr<HullView>> KnownHulls::Views(std::span<const std::string> ids) const {
  HULLD_CHECK(ids.size() == hull_of_.size());
  std::vector<absl::StatusOr<HullView>> views;
  views.reserve(ids.size());
  for (const uint32_t hull : hull_of_) views.push_back(hulls_[hull].view);
  return views;
}

}  // namespace hulld::server
