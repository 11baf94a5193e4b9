#include "server/migration/sharded_source.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

namespace hulld::server {
namespace {

absl::Status ToBeRead() { return absl::FailedPreconditionError("the source is only read"); }

// Visits what several stores hold of some IDs, sorted by these. for_each: calls a visitor with all
// that one store holds.
template <typename Stored, typename ForEach, typename Visitor>
absl::Status VisitSorted(std::span<Store* const> stores, const ShardedSource::HasId& has,
                         const ForEach& for_each, const Visitor& visit) {
  std::vector<std::pair<std::string, absl::StatusOr<Stored>>> all;
  for (Store* const store : stores) {
    const absl::Status status =
        for_each(*store, [&](const std::string& id, absl::StatusOr<Stored> stored) {
          if (!has(id)) return;
          if (stores.size() == 1) return visit(id, std::move(stored));
          all.emplace_back(id, std::move(stored));
        });
    if (!status.ok()) return status;
  }
  std::ranges::sort(all, {}, [](const auto& one) -> const std::string& { return one.first; });
  for (auto& [id, stored] : all) visit(id, std::move(stored));
  return absl::OkStatus();
}

}  // namespace

ShardedSource::ShardedSource(std::span<Store* const> stores, HasId has, StoreOfId store_of)
    : stores_(stores.begin(), stores.end()), has_(std::move(has)), store_of_(std::move(store_of)) {}

std::string ShardedSource::id() const {
  std::string id;
  for (const Store* store : stores_) absl::StrAppend(&id, id.empty() ? "" : "+", store->id());
  return id;
}

uint64_t ShardedSource::revision() const {
  uint64_t revision = 0;
  for (const Store* store : stores_) revision = std::max(revision, store->revision());
  return revision;
}

absl::Status ShardedSource::ForEachHull(const StoredHullVisitor& visit) {
  return VisitSorted<StoredHull>(
      stores_, has_,
      [](Store& store, const StoredHullVisitor& take) { return store.ForEachHull(take); }, visit);
}

absl::Status ShardedSource::ForEachBody(const StoredBodyVisitor& visit) {
  return VisitSorted<StoredBody>(
      stores_, has_,
      [](Store& store, const StoredBodyVisitor& take) { return store.ForEachBody(take); }, visit);
}

absl::Status ShardedSource::Commit(std::span<Change* const>) { return ToBeRead(); }

absl::StatusOr<std::string> ShardedSource::MakeCopy() { return ToBeRead(); }

}  // namespace hulld::server
