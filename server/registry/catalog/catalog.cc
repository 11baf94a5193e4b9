#include "server/registry/catalog/catalog.h"

#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "server/contract/error_info.h"
#include "server/contract/limit_error.h"
#include "server/registry/catalog/registered_hull.h"

namespace hulld::server {
namespace {

// Returns the number of records that fill a sixteenth of the limit, in addition to the memory held
// for points.
size_t MaxRecords(uint64_t memory_limit) {
  return std::max<uint64_t>(1 << 12, memory_limit / 16 / HullTable::kBytesOfRecord);
}

// Unused bodies may use up to 1/kBodiesShare of the limit.
constexpr uint64_t kBodiesShare = 16;

}  // namespace

Catalog::Catalog(const Store& store, const Limits& limits, MemoryBudget& budget)
    : is_cache_(store.finds_records()),
      max_hulls_(limits.max_hulls),
      budget_(budget),
      hulls_(store.keeps_hulls(), budget) {
  if (!is_cache_) return;
  hulls_.KeepAtMost(MaxRecords(limits.memory_limit));
  bodies_.KeepAtMost(limits.memory_limit / kBodiesShare);
}

void Catalog::Begin(uint64_t revision) {
  HULLD_CHECK(hulls_.size() == 0 && revision_ == 0);
  revision_ = revision;
}

void Catalog::Publish(uint64_t revision) {
  HULLD_CHECK(revision > revision_);
  revision_ = revision;
}

HullPointer Catalog::Find(const std::string& id) {
  std::optional<HullPointer> hull = hulls_.Ask(id);
  HULLD_CHECK(hull.has_value() || bodies_.contains(id));
  return std::move(hull).value_or(nullptr);
}

HullPointer Catalog::FindVisible(const std::string& id) {
  HullPointer hull = Find(id);
  return hull != nullptr && hull->state.visible() ? hull : nullptr;
}

std::shared_ptr<const Body> Catalog::FindBody(const std::string& id) {
  const BodyTable::Entry* const entry = bodies_.Find(id);
  return entry == nullptr ? nullptr : entry->committed();
}

BodyTable::Entry* Catalog::BodyInFlight(const std::string& id) {
  BodyTable::Entry* const entry = bodies_.Find(id);
  return entry != nullptr && entry->in_flight ? entry : nullptr;
}

absl::Status Catalog::NoSuchHull(const std::string& id) const {
  if (!bodies_.contains(id)) return HullNotFound(id);
  return WithReason(
      absl::NotFoundError(absl::StrCat("\"", id, "\" is a body; this call requires a hull")),
      v1::ERROR_REASON_HULL_NOT_FOUND, {{"hull_id", id}});
}

void Catalog::AddStored(const std::string& id, const absl::StatusOr<StoredHull>& stored) {
  if (stored.ok()) {
    hulls_.AddResting(*stored);
    if (!is_cache_) NoteVertices(0, stored->record.vertex_count);
    return;
  }
  spdlog::error("{}", std::string(stored.status().message()));
  StoredHull nothing;
  nothing.record.hull_id = id;
  MarkDamaged(*hulls_.Insert(nothing, HullState::Present()), stored.status());
}

void Catalog::MarkDamaged(RegisteredHull& hull, const absl::Status& damage) {
  if (hull.state.damaged() || hull.state.life() != HullState::Life::kPresent) return;
  hull.state.Damage(damage);
  NoteChange(hull);
  ++statistics_.damaged;
}

void Catalog::NoteChange(const RegisteredHull& hull) {
  recent_changes_.Note(hull.committed().record.hull_id);
}

void Catalog::Forget(Locked& locked, const HullPointer& hull, const absl::Status& reason) {
  HULLD_CHECK(hull->state.gone());
  hulls_.Erase(hull);
  for (auto& [number, on_gone] : hull->watches) {
    locked.Afterwards([on_gone = std::move(on_gone), reason] { on_gone(reason); });
  }
  hull->watches.clear();
  hull->DiscardAll(locked);
  hull->account.Close();
}

void Catalog::AddBody(Locked& locked, const std::string& id,
                      const absl::StatusOr<StoredBody>& stored) {
  if (!stored.ok()) {
    spdlog::error("{}", std::string(stored.status().message()));
    ++statistics_.damaged;
  }
  bodies_.Add(id);
  bodies_.Set(locked, id, std::make_shared<const Body>(id, stored, budget_, UseOfRead()));
  hulls_.ForgetAbsent(id);
}

void Catalog::LogBodyUnderHull(const std::string& id) {
  spdlog::error(
      "the store contains a body under the ID of hull \"{}\"; the body is ignored; delete one of "
      "the "
      "two",
      id);
}

void Catalog::EraseBody(Locked& locked, const std::string& id) {
  bodies_.Erase(locked, id);
  if (is_cache_) hulls_.NoteAbsent(id);
}

absl::Status Catalog::CheckHullCount() const {
  const uint64_t hulls = HullCount();
  const uint64_t bodies = BodyCount();
  if (hulls + bodies < max_hulls_) return absl::OkStatus();
  std::string held = absl::StrCat("the store contains ", hulls, " hulls");
  if (bodies > 0) absl::StrAppend(&held, " and ", bodies, " bodies");
  return LimitExceeded(held, max_hulls_, "max-hulls");
}

RegistrySizes Catalog::Sizes() const {
  return {revision_, HullCount() - creating_hulls_, vertex_count_, kept_bodies_};
}

void Catalog::EndCreatingHull(Locked& locked, const HullPointer& hull, const absl::Status& status) {
  --creating_hulls_;
  if (!status.ok()) return Forget(locked, hull, status);
  ++kept_hulls_;
}

void Catalog::EndCreatingBody(bool is_committed) {
  --creating_bodies_;
  if (is_committed) ++kept_bodies_;
}

void Catalog::SetTotals(const StoreTotals& totals) {
  HULLD_CHECK(is_cache_);
  kept_hulls_ = totals.hulls;
  vertex_count_ = totals.vertices;
  kept_bodies_ = totals.bodies;
}

}  // namespace hulld::server
