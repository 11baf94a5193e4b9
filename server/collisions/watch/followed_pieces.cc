#include "server/collisions/watch/followed_pieces.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>

#include "core/base/check.h"

namespace hulld::server {
namespace {

// Bytes of an ID, in a body's list and with the nodes of a map and of a set. A guess.
size_t BytesOf(const std::string& id) { return 2 * id.size() + 256; }

}  // namespace

void FollowedPieces::Difference::Settle() {
  std::ranges::sort(added);
  std::ranges::sort(dropped);
  std::vector<std::string> both;
  std::ranges::set_intersection(added, dropped, std::back_inserter(both));
  const auto stays = [&both](const std::string& id) {
    return std::ranges::binary_search(both, id);
  };
  std::erase_if(added, stays);
  std::erase_if(dropped, stays);
}

void FollowedPieces::Set(size_t body, std::span<const std::string> hull_ids,
                         Difference* difference) {
  const auto known = hulls_of_.find(body);
  const std::span<const std::string> before =
      known == hulls_of_.end() ? std::span<const std::string>() : known->second;
  if (std::ranges::equal(before, hull_ids)) return;
  // Adds before it drops, so that hulls that stay are neither added nor dropped.
  for (const std::string& id : hull_ids) {
    const auto [hull, is_new] = hulls_.try_emplace(id);
    if (is_new) difference->added.push_back(id);
    hull->second.bodies.insert(body);
    bytes_ += BytesOf(id);
  }
  const std::set<std::string_view> now(hull_ids.begin(), hull_ids.end());
  for (const std::string& id : before) {
    bytes_ -= BytesOf(id);
    if (now.contains(id)) continue;
    const auto hull = hulls_.find(id);
    HULLD_CHECK(hull != hulls_.end());
    hull->second.bodies.erase(body);
    if (!hull->second.bodies.empty()) continue;
    difference->dropped.push_back(id);
    hulls_.erase(hull);
  }
  if (hull_ids.empty()) {
    hulls_of_.erase(body);
  } else {
    hulls_of_[body].assign(hull_ids.begin(), hull_ids.end());
  }
}

std::set<size_t> FollowedPieces::BodiesOf(const std::string& hull_id) const {
  const auto found = hulls_.find(hull_id);
  return found == hulls_.end() ? std::set<size_t>() : found->second.bodies;
}

bool FollowedPieces::IsNews(const HullRecord& hull) {
  const auto found = hulls_.find(hull.hull_id);
  if (found == hulls_.end()) return false;
  Followed& told = found->second;
  if (told.create_revision == hull.create_revision && told.revision == hull.revision) return false;
  told.create_revision = hull.create_revision;
  told.revision = hull.revision;
  return true;
}

}  // namespace hulld::server
