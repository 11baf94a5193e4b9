#include "core/query/placed/live_hull.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/integer.h"
#include "core/query/placed/live_parts.h"

namespace hulld {
namespace {

constexpr size_t kFirstTailCapacity = 16;
// Cost of preparing a point, in scanned points. Observed: 0.3 to 1 us against 0.3 to 1 ns.
constexpr uint64_t kScansPerPrepared = 800;
// Average number of directions per query.
constexpr uint64_t kDirectionsPerQuery = 6;
// A new level absorbs preceding levels that are at most this many times as large.
constexpr size_t kMergeRatio = 2;

std::vector<Vector> PointsOf(const LiveParts& parts, uint64_t count) {
  std::vector<Vector> points;
  if (parts.base == nullptr) return points;
  HULLD_CHECK(count >= parts.covered);
  points.assign(parts.base->points().begin(), parts.base->points().end());
  for (const auto& level : parts.levels) {
    points.insert(points.end(), level->mapped.points.begin(), level->mapped.points.end());
  }
  for (uint64_t i = 0; i < count - parts.covered; ++i) points.push_back(parts.tail->point(i));
  return points;
}

// Returns a tail with the points [begin, end) of another and spare capacity; null if there are
// none.
std::shared_ptr<GrowthTail> CopyOf(const GrowthTail* tail, size_t begin, size_t end,
                                   const Vector& center) {
  if (begin == end) return nullptr;
  const size_t capacity = std::max(kFirstTailCapacity, 2 * (end - begin));
  auto copy = std::make_shared<GrowthTail>(capacity, center);
  for (size_t i = begin; i < end; ++i) copy->Append(tail->point(i));
  return copy;
}

// Prepares points. If queries can never find many of them, drops these and prepares the rest.
MappedPoints Map(std::vector<Vector> points) {
  MappedPoints mapped(std::move(points));
  const std::vector<uint32_t> listed = mapped.support.Listed();
  if (4 * listed.size() > 3 * mapped.points.size()) return mapped;
  std::vector<Vector> kept;
  kept.reserve(listed.size());
  for (const uint32_t i : listed) kept.push_back(mapped.points[i]);
  return MappedPoints(std::move(kept));
}

}  // namespace

LiveHull::LiveHull() : scanned_(std::make_shared<std::atomic<uint64_t>>(0)) {
  now_.parts_ = std::make_shared<const LiveParts>();
}

LiveHull::LiveHull(std::vector<Vector> points, int dimension) : LiveHull() {
  if (!points.empty()) Begin(std::move(points), dimension, now_);
}

LiveHull::LiveHull(const LiveHull& other, const Mark& mark) : LiveHull() {
  if (mark.count_ == 0) return;
  Parts parts;
  {
    const std::lock_guard lock(other.mutex_);
    parts = other.PartsFor(mark);
  }
  const size_t tail_count = mark.count_ - parts->covered;
  now_ = mark;
  now_.parts_ = std::make_shared<const LiveParts>(
      LiveParts{parts->base, parts->levels, parts->covered,
                CopyOf(parts->tail.get(), 0, tail_count, parts->base->center())});
}

// Turns all points so far into a base to be scanned.
void LiveHull::Begin(std::vector<Vector> points, int dimension, Mark& next) {
  for (const Vector& p : points) {
    next.low_ = next.low_.cwiseMin(p);
    next.high_ = next.high_.cwiseMax(p);
  }
  next.count_ = std::max<uint64_t>(next.count_ + 1, points.size());
  next.dimension_ = dimension;
  auto base = std::make_shared<const HullBase>(std::move(points), dimension);
  next.exponent_ = base->exponent();
  next.parts_ =
      std::make_shared<const LiveParts>(LiveParts{std::move(base), {}, next.count_, nullptr});
}

LiveHull::Mark LiveHull::Append(std::span<const Vector> points, int dimension) {
  // Only the holder of this mutex changes now_ and the tail, so both can be read without mutex_.
  const std::lock_guard changing(changing_);
  if (points.empty()) return now_;
  Mark next = now_;
  if (dimension == next.dimension_) {
    AppendToTail(points, next);
  } else {
    std::vector<Vector> all = PointsOf(*next.parts_, next.count_);
    all.insert(all.end(), points.begin(), points.end());
    Begin(std::move(all), dimension, next);
  }
  Mark before = next;
  {
    const std::lock_guard lock(mutex_);
    std::swap(now_, before);
  }
  return next;
}

// Readers never read a tail beyond the count in their mark.
void LiveHull::AppendToTail(std::span<const Vector> points, Mark& next) {
  const size_t tail_count = next.count_ - next.parts_->covered;
  const GrowthTail* const former = next.parts_->tail.get();
  HULLD_CHECK((former == nullptr ? 0 : former->size()) == tail_count);
  const size_t former_capacity = former == nullptr ? 0 : former->capacity();
  if (tail_count + points.size() > former_capacity) {
    LiveParts parts = *next.parts_;
    const size_t capacity =
        std::max({kFirstTailCapacity, 2 * former_capacity, tail_count + points.size()});
    auto tail = std::make_shared<GrowthTail>(capacity, parts.base->center());
    for (size_t i = 0; i < tail_count; ++i) tail->Append(parts.tail->point(i));
    parts.tail = std::move(tail);
    next.parts_ = std::make_shared<const LiveParts>(std::move(parts));
  }
  for (const Vector& p : points) {
    next.parts_->tail->Append(p);
    next.low_ = next.low_.cwiseMin(p);
    next.high_ = next.high_.cwiseMax(p);
    next.exponent_ = LowestBitExponent(p, next.exponent_);
  }
  next.count_ += points.size();
}

LiveHull::Mark LiveHull::Now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

// The current parts may cover points appended after the mark; then the parts stored in the mark are
// used.
const LiveHull::Parts& LiveHull::PartsFor(const Mark& mark) const {
  return mark.count_ >= now_.parts_->covered ? now_.parts_ : mark.parts_;
}

std::shared_ptr<const QueryHull> LiveHull::VersionAt(const Mark& mark) const {
  std::shared_ptr<QueryHull> version(new QueryHull());
  if (mark.count_ == 0) return version;
  Parts parts;
  std::shared_ptr<std::atomic<uint64_t>> scanned;
  {
    const std::lock_guard lock(mutex_);
    parts = PartsFor(mark);
    scanned = scanned_;
  }
  const HullBase& base = *parts->base;
  const size_t tail_count = mark.count_ - parts->covered;
  version->base_ = parts->base;
  version->dimension_ = mark.dimension_;
  version->exponent_ = mark.exponent_;
  version->max_abs_ = std::max(mark.low_.cwiseAbs().maxCoeff(), mark.high_.cwiseAbs().maxCoeff());
  version->center_ = base.center();
  version->radius_ = base.radius();
  if (tail_count > 0) version->radius_ = std::max(base.radius(), parts->tail->RadiusOf(tail_count));
  size_t count = base.points().size() + tail_count;
  for (const auto& level : parts->levels) {
    version->radius_ = std::max(version->radius_, level->radius);
    count += level->mapped.points.size();
  }
  version->point_count_ = static_cast<uint32_t>(count);
  if (base.prepared() && parts->levels.empty() && tail_count == 0) return version;
  const uint64_t scans = tail_count + (base.prepared() ? 0 : base.points().size());
  version->growth_ = std::make_unique<const QueryHull::Growth>(
      QueryHull::Growth{std::move(parts), tail_count, std::move(scanned), scans});
  return version;
}

std::vector<Vector> LiveHull::PointsAt(const Mark& mark) const {
  if (mark.count_ == 0) return {};
  Parts parts;
  {
    const std::lock_guard lock(mutex_);
    parts = PartsFor(mark);
  }
  return PointsOf(*parts, mark.count_);
}

bool LiveHull::WantsPreparing(const Mark& mark, uint64_t more_queries) const {
  if (mark.count_ == 0) return false;
  const std::lock_guard lock(mutex_);
  const LiveParts& parts = *PartsFor(mark);
  const uint64_t scans =
      mark.count_ - parts.covered + (parts.base->prepared() ? 0 : parts.base->points().size());
  if (scans == 0) return false;
  return scanned_->load(std::memory_order_relaxed) + more_queries * kDirectionsPerQuery * scans >=
         kScansPerPrepared * scans;
}

void LiveHull::Prepare(const Mark& mark) {
  if (mark.count_ == 0) return;
  Parts before;
  {
    const std::lock_guard lock(mutex_);
    before = PartsFor(mark);
  }
  if (mark.count_ == before->covered && before->base->prepared()) return;
  LiveParts after = Prepared(*before, mark);

  const std::lock_guard changing(changing_);
  const LiveParts& current = *now_.parts_;
  // If the dimension grew during the preparation, a new base contains all points.
  if (current.covered > mark.count_) return;
  after.tail = CopyOf(current.tail.get(), mark.count_ - current.covered,
                      now_.count_ - current.covered, after.base->center());
  Parts parts = std::make_shared<const LiveParts>(std::move(after));
  auto scanned = std::make_shared<std::atomic<uint64_t>>(0);
  const std::lock_guard lock(mutex_);
  // The replaced parts are destroyed after the mutex is released.
  std::swap(now_.parts_, parts);
  std::swap(scanned_, scanned);
}

// Returns the state at the mark as base and levels, all prepared, without a tail.
LiveParts LiveHull::Prepared(const LiveParts& before, const Mark& mark) {
  const size_t tail_count = mark.count_ - before.covered;
  LiveParts after = {before.base, before.levels, mark.count_, nullptr};
  size_t merged = tail_count;
  size_t kept = after.levels.size();
  while (kept > 0 && after.levels[kept - 1]->mapped.points.size() <= kMergeRatio * merged) {
    merged += after.levels[--kept]->mapped.points.size();
  }
  if (!before.base->prepared() || before.base->points().size() <= kMergeRatio * merged) {
    std::vector<Vector> points = PointsOf(before, mark.count_);
    points_moved_ += points.size();
    after.base = std::make_shared<const HullBase>(Map(std::move(points)), mark.dimension_);
    after.levels.clear();
  } else {
    std::vector<Vector> points;
    points.reserve(merged);
    double radius = tail_count == 0 ? 0 : before.tail->RadiusOf(tail_count);
    for (size_t i = kept; i < after.levels.size(); ++i) {
      radius = std::max(radius, after.levels[i]->radius);
      const std::vector<Vector>& level = after.levels[i]->mapped.points;
      points.insert(points.end(), level.begin(), level.end());
    }
    for (size_t i = 0; i < tail_count; ++i) points.push_back(before.tail->point(i));
    points_moved_ += points.size();
    after.levels.resize(kept);
    after.levels.push_back(std::make_shared<const PreparedLevel>(Map(std::move(points)), radius));
  }
  return after;
}

size_t LiveHull::OwnBytes() { return sizeof(LiveHull) + sizeof(LiveParts); }

size_t LiveHull::MemoryBytes() const {
  size_t bytes = OwnBytes();
  std::vector<Shared> shared;
  const std::lock_guard lock(mutex_);
  AddShared(*now_.parts_, shared);
  for (const Shared& part : shared) bytes += part.bytes;
  return bytes;
}

std::vector<LiveHull::Shared> LiveHull::SharedBy(const Mark& mark) const {
  std::vector<Shared> shared;
  const std::lock_guard lock(mutex_);
  AddShared(*now_.parts_, shared);
  if (mark.count_ > 0 && PartsFor(mark) != now_.parts_) AddShared(*PartsFor(mark), shared);
  return shared;
}

// Parts that are not yet in `shared`.
void LiveHull::AddShared(const LiveParts& parts, std::vector<Shared>& shared) {
  const auto add = [&](const void* what, size_t bytes) {
    const auto is_it = [what](const Shared& known) { return known.what == what; };
    if (std::ranges::none_of(shared, is_it)) shared.push_back({what, bytes});
  };
  if (parts.base != nullptr) add(parts.base.get(), parts.base->MemoryBytes());
  if (parts.tail != nullptr) add(parts.tail.get(), parts.tail->MemoryBytes());
  for (const auto& level : parts.levels) {
    add(level.get(), sizeof(PreparedLevel) + level->mapped.points.capacity() * sizeof(Vector) +
                         level->mapped.support.MemoryBytes());
  }
}

}  // namespace hulld
