#include "server/registry/memory/served_hull.h"

#include <mutex>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/hull/growth/hull_builder.h"
#include "server/contract/stopped_call.h"
#include "server/registry/memory/hull_loader.h"

namespace hulld::server {
namespace {

std::vector<Vector> PointsOf(const QueryHull& version) {
  std::vector<Vector> points;
  points.reserve(version.point_count());
  for (uint32_t i = 0; i < version.point_count(); ++i) points.push_back(version.point(i));
  return points;
}

absl::StatusOr<Hull> MakeSnapshot(const QueryHull& version, const HullRecord& record,
                                  const std::function<bool()>& should_stop) {
  HULLD_ASSIGN_OR_RETURN(const std::unique_ptr<HullBuilder> builder,
                         BuildHull(record, PointsOf(version), should_stop));
  return builder->Snapshot(should_stop);
}

}  // namespace

CanonicalHull::CanonicalHull(Hull hull) { Keep(std::move(hull)); }

void CanonicalHull::Keep(Hull hull) {
  HULLD_CHECK(!is_made());
  hull_ = std::make_unique<const Hull>(std::move(hull));
  hull_bytes_.store(hull_->MemoryBytes(), std::memory_order_release);
  Count();
}

void CanonicalHull::Count() const {
  if (part_ != nullptr) part_->SetBytes(MemoryBytes());
}

absl::Status CanonicalHull::MakeOnce(const std::function<bool()>& should_stop,
                                     const std::function<bool()>& is_done,
                                     const std::function<absl::Status()>& make) {
  std::unique_lock lock(mutex_);
  while (making_) {
    changed_.wait_for(lock, kStopPoll);
    if (Stopped(should_stop)) return Cancelled();
  }
  if (is_done()) return absl::OkStatus();
  making_ = true;
  lock.unlock();
  const absl::Status status = make();
  lock.lock();
  making_ = false;
  lock.unlock();
  changed_.notify_all();
  return status;
}

absl::Status CanonicalHull::Make(const QueryHull& version, const HullRecord& record,
                                 const std::function<bool()>& should_stop) {
  return MakeOnce(
      should_stop, [this] { return is_made(); },
      [&] {
        HULLD_ASSIGN_OR_RETURN(Hull made, MakeSnapshot(version, record, should_stop));
        Keep(std::move(made));
        return absl::OkStatus();
      });
}

absl::Status CanonicalHull::MakeQueryHull(const std::function<bool()>& should_stop) {
  HULLD_CHECK(is_made());
  return MakeOnce(
      should_stop, [this] { return has_query_hull(); },
      [&] {
        HULLD_ASSIGN_OR_RETURN(QueryHull made, QueryHull::Prepare(*hull_, should_stop));
        query_hull_ = std::make_unique<const QueryHull>(std::move(made));
        query_hull_bytes_.store(query_hull_->MemoryBytes(), std::memory_order_release);
        Count();
        return absl::OkStatus();
      });
}

const QueryHull& CanonicalHull::query_hull() {
  if (!has_query_hull()) HULLD_CHECK(MakeQueryHull({}).ok());
  return *query_hull_;
}

ServedHull::ServedHull(std::shared_ptr<const QueryHull> version, const Box& box,
                       std::shared_ptr<CanonicalHull> canonical)
    : version_(std::move(version)), box_(box), canonical_(std::move(canonical)) {
  HULLD_CHECK(version_ != nullptr && canonical_ != nullptr);
}

}  // namespace hulld::server
