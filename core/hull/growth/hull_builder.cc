#include "core/hull/growth/hull_builder.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/hull/growth/block_insertion.h"
#include "core/hull/growth/canonical_snapshot.h"
#include "core/hull/growth/polygon_boundary.h"
#include "core/hull/surface/kept_before.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/ieee_arithmetic.h"
#include "core/numeric/orientation.h"

namespace hulld {
namespace {

// Insertions between two polls of should_stop.
constexpr size_t kInsertionsPerPoll = 256;
// Number of points sampled, up to a factor of two, to find some that are extreme along the axes.
constexpr size_t kExtremesSample = 4096;
// Number of points at which the order of insertion starts to matter.
constexpr size_t kWorthOrdering = 128;

// Branch-free except for the loop, so that the compiler vectorizes it.
bool AreFinite(std::span<const Vector> points) {
  int64_t bad = 0;
  for (const Vector& p : points) {
    for (int k = 0; k < 3; ++k) bad |= std::abs(p[k]) <= kLargestDouble ? 0 : 1;
  }
  return bad == 0;
}

// Requires: at least one non-finite coordinate.
absl::Status DescribeNotFinite(std::span<const Vector> points) {
  constexpr const char* kNames[] = {"x", "y", "z"};
  for (size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      if (std::isfinite(points[i][k])) continue;
      return absl::InvalidArgumentError(absl::StrCat(
          "points[", i, "].", kNames[k], " is ", std::isnan(points[i][k]) ? "NaN" : "infinite"));
    }
  }
  HULLD_UNREACHABLE();
}

// Returns the indices, without duplicates, of the lowest and highest coordinates along each axis in
// a sample spread over all points. A hull starts from these points.
std::vector<uint32_t> AxisExtremes(std::span<const Vector> points) {
  const size_t stride = points.size() / kExtremesSample + 1;
  std::array<uint32_t, 6> extremes{};
  Vector lowest = points[0];
  Vector highest = points[0];
  for (size_t i = 0; i < points.size(); i += stride) {
    const Vector& p = points[i];
    // One rarely taken branch instead of six.
    const auto is_new = [&](int k) { return int{p[k] < lowest[k]} | int{p[k] > highest[k]}; };
    if ((is_new(0) | is_new(1) | is_new(2)) == 0) continue;
    for (int k = 0; k < 3; ++k) {
      if (p[k] < lowest[k]) extremes[static_cast<size_t>(k)] = static_cast<uint32_t>(i);
      if (p[k] > highest[k]) extremes[static_cast<size_t>(k) + 3] = static_cast<uint32_t>(i);
    }
    lowest = lowest.cwiseMin(p);
    highest = highest.cwiseMax(p);
  }
  std::vector<uint32_t> distinct(extremes.begin(), extremes.end());
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  return distinct;
}

bool LexicographicallyLess(const Vector& a, const Vector& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

// The hull in the stage of its dimension: loose vertices up to dimension 1, then a polygon, then a
// surface.
class HullBuilder::State {
 public:
  // Starts a journal: later changes can be undone until it ends.
  void StartJournal() {
    vertices_.StartJournal();
    before_.Start({ends_, polygon_.has_value(), surface_.has_value(), std::nullopt});
    if (polygon_) polygon_->StartJournal();
    if (surface_) surface_->StartJournal();
  }
  // Restores the state at the start of the journal.
  void Undo() {
    HULLD_CHECK(before_);
    ends_ = before_->ends;
    if (before_->has_surface) {
      surface_->Undo();
    } else {
      surface_.reset();
    }
    if (before_->polygon) polygon_ = std::move(before_->polygon);
    if (before_->has_polygon) {
      polygon_->Undo();
    } else {
      polygon_.reset();
    }
    vertices_.Undo();
    before_.End();
  }
  // Ends the journal and keeps the changes.
  void EndJournal() {
    vertices_.EndJournal();
    if (polygon_) polygon_->EndJournal();
    if (surface_ && before_->has_surface) surface_->EndJournal();
    before_.End();
  }
  size_t JournalBytes() const {
    size_t bytes = vertices_.JournalBytes();
    if (polygon_) bytes += polygon_->JournalBytes();
    if (before_->polygon) bytes += before_->polygon->MemoryBytes();
    if (surface_) bytes += surface_->JournalBytes();
    return bytes;
  }

  void BeginBlock() { vertices_.BeginBlock(); }
  void FinishBlock() { vertices_.FinishBlock(); }
  void Insert(const Vector& point) {
    if (surface_) return surface_->Insert(vertices_, point);
    switch (dimension()) {
      case -1:
        return GrowToPoint(point);
      case 0:
        return GrowToSegment(point);
      case 1:
        return InsertIntoSegment(point);
      case 2:
        return InsertIntoPolygon(point);
    }
    HULLD_UNREACHABLE();
  }

  // Inserts all points. Returns false, with some of them inserted, if the poll stopped.
  bool InsertAll(std::span<const Vector> points, StopPoll& poll) {
    if (points.size() < kWorthOrdering) {
      for (const Vector& point : points) {
        if (poll.Step(1 + TakeSteps())) return false;
        Insert(point);
      }
      return true;
    }
    std::vector<uint32_t> done;
    if (dimension() < 0) done = AxisExtremes(points);
    for (const uint32_t i : done) Insert(points[i]);
    for (size_t i = 0; i < points.size(); ++i) {
      if (surface_) {
        std::erase_if(done, [i](uint32_t index) { return index < i; });
        for (uint32_t& index : done) index -= static_cast<uint32_t>(i);
        return InsertBlock(*surface_, vertices_, points.subspan(i), done, poll);
      }
      if (std::find(done.begin(), done.end(), i) != done.end()) continue;
      if (poll.Step()) return false;
      Insert(points[i]);
    }
    return true;
  }

  int dimension() const {
    if (surface_) return 3;
    if (polygon_) return 2;
    return static_cast<int>(ends_.size()) - 1;
  }
  const VertexTable& vertices() const { return vertices_; }
  size_t MemoryBytes() const {
    size_t bytes = sizeof(State) + vertices_.MemoryBytes() + ends_.capacity() * sizeof(VertexId);
    if (polygon_) bytes += polygon_->MemoryBytes();
    if (surface_) bytes += surface_->MemoryBytes();
    return bytes;
  }
  uint64_t housekeeping_steps() const { return surface_ ? surface_->work() : 0; }

  // Returns nullopt if stopped.
  std::optional<Hull> Snapshot(StopPoll& poll) const {
    if (surface_) return SnapshotOf(vertices_, *surface_, poll);
    if (polygon_) return SnapshotOfPolygon(vertices_, polygon_->Loop(), poll);
    return SnapshotOfEnds(vertices_, ends_);
  }

 private:
  uint64_t TakeSteps() { return surface_ ? surface_->TakeSteps() : 0; }
  void GrowToPoint(const Vector& point) { ends_.push_back(vertices_.Add(point)); }

  void GrowToSegment(const Vector& point) {
    if (point == vertices_[ends_[0]]) return vertices_.CountDuplicate(ends_[0]);
    ends_.push_back(vertices_.Add(point));
    if (LexicographicallyLess(point, vertices_[ends_[0]])) std::swap(ends_[0], ends_[1]);
  }

  // On one line, the order along the line and the lexicographic order agree.
  void InsertIntoSegment(const Vector& point) {
    const CoordinatePlane plane = ProjectionOf(vertices_[ends_[0]], vertices_[ends_[1]], point);
    if (plane.first >= 0) {
      const VertexId id = vertices_.Add(point);
      plane_ = {vertices_[ends_[0]], vertices_[ends_[1]], point};
      polygon_.emplace(vertices_, plane, ends_[0], ends_[1], id);
      return;
    }
    for (const VertexId end : ends_) {
      if (point == vertices_[end]) return vertices_.CountDuplicate(end);
    }
    if (LexicographicallyLess(point, vertices_[ends_[0]])) return ReplaceEnd(0, point);
    if (LexicographicallyLess(vertices_[ends_[1]], point)) return ReplaceEnd(1, point);
  }

  void ReplaceEnd(int end, const Vector& point) {
    vertices_.Remove(ends_[end]);
    ends_[end] = vertices_.Add(point);
  }

  void InsertIntoPolygon(const Vector& point) {
    if (Orient3d(plane_[0], plane_[1], plane_[2], point) == 0) {
      return polygon_->Insert(vertices_, point);
    }
    const std::vector<VertexId> loop = polygon_->Loop();
    surface_.emplace(vertices_, loop, vertices_.Add(point));
    if (before_ && before_->has_polygon) before_->polygon = std::move(polygon_);
    polygon_.reset();
  }

  VertexTable vertices_;
  // Dimensions 0 and 1: the vertices, in lexicographic order.
  std::vector<VertexId> ends_;
  std::optional<PolygonBoundary> polygon_;
  // Dimension 2: three points, not collinear, that span the plane.
  std::array<Vector, 3> plane_;
  std::optional<Surface> surface_;

  // Journal of this class, in addition to the journals of the parts: the stage, and the polygon
  // after a surface has replaced it.
  struct Before {
    std::vector<VertexId> ends;
    bool has_polygon;
    bool has_surface;
    std::optional<PolygonBoundary> polygon;
  };
  KeptBefore<Before> before_;
};

HullBuilder::HullBuilder() : state_(std::make_unique<State>()) { HULLD_CHECK(HasIeeeArithmetic()); }
HullBuilder::HullBuilder(const HullBuilder& other)
    : state_(std::make_unique<State>(*other.state_)), undo_bytes_(other.undo_bytes_) {}
HullBuilder& HullBuilder::operator=(const HullBuilder& other) {
  if (this != &other) *this = HullBuilder(other);
  return *this;
}
HullBuilder::HullBuilder(HullBuilder&&) noexcept = default;
HullBuilder& HullBuilder::operator=(HullBuilder&&) noexcept = default;
HullBuilder::~HullBuilder() = default;

absl::StatusOr<PointCounts> HullBuilder::Add(std::span<const Vector> points,
                                             const AddLimits& limits) {
  if (!AreFinite(points)) return DescribeNotFinite(points);
  const bool may_stop = limits.should_stop && points.size() > 1;
  const bool may_exceed = vertex_count() + points.size() > limits.max_vertices;
  const bool may_fail = may_stop || may_exceed;
  if (may_fail) state_->StartJournal();
  state_->BeginBlock();
  const std::function<bool()> never;
  StopPoll poll(may_stop ? limits.should_stop : never, kInsertionsPerPoll);
  // Any code that noticed the stop may have skipped points.
  const bool is_done = state_->InsertAll(points, poll) && !poll.stopped();
  const size_t reached = vertex_count();
  undo_bytes_ = may_fail ? state_->JournalBytes() : 0;
  if (!is_done || reached > limits.max_vertices) {
    state_->Undo();
    if (!is_done) {
      return absl::CancelledError("adding points was cancelled; the hull is unchanged");
    }
    return absl::ResourceExhaustedError(absl::StrCat(
        "the hull would have ", reached, " vertices; the limit is ", limits.max_vertices));
  }
  if (may_fail) state_->EndJournal();
  state_->FinishBlock();
  HULLD_CHECK(state_->vertices().outside() + state_->vertices().duplicate() <= points.size());
  PointCounts counts;
  counts.received = points.size();
  counts.outside = state_->vertices().outside();
  counts.duplicate = state_->vertices().duplicate();
  counts.inside = counts.received - counts.outside - counts.duplicate;
  return counts;
}

int HullBuilder::dimension() const { return state_->dimension(); }

size_t HullBuilder::vertex_count() const { return state_->vertices().size(); }

std::vector<Vector> HullBuilder::Vertices() const { return state_->vertices().Vertices(); }

std::vector<Vector> HullBuilder::NewVertices() const { return state_->vertices().NewVertices(); }

size_t HullBuilder::MemoryBytes() const { return sizeof(*this) + state_->MemoryBytes(); }

uint64_t HullBuilder::housekeeping_steps() const { return state_->housekeeping_steps(); }

Hull HullBuilder::Snapshot() const {
  StopPoll never;
  std::optional<Hull> snapshot = state_->Snapshot(never);
  HULLD_CHECK(snapshot.has_value());
  return *std::move(snapshot);
}

absl::StatusOr<Hull> HullBuilder::Snapshot(const std::function<bool()>& should_stop) const {
  StopPoll poll(should_stop);
  std::optional<Hull> snapshot = state_->Snapshot(poll);
  if (!snapshot.has_value()) return absl::CancelledError("building the snapshot was cancelled");
  return *std::move(snapshot);
}

}  // namespace hulld
