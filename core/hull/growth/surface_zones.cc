// Insertions of Surface by several threads at once.

#include <algorithm>
#include <atomic>
#include <utility>

#include "core/hull/growth/surface.h"

namespace hulld {
namespace {

// Insertions between two polls of should_stop.
constexpr size_t kPointsPerPoll = 256;

// The part of space round the center, 1 to `zones`: halves or quarters, by signs of coordinates.
uint32_t ZoneOf(const Vector& center, const Vector& point, size_t zones) {
  const uint32_t half = point.x() > center.x() ? 1 : 2;
  return zones > 2 && point.y() > center.y() ? half + 2 : half;
}

}  // namespace

// Idea: a thread changes only triangles of its zone, and an insertion that meets another one is put
// off. A triangle between zones belongs to none, hence stays as it is: so no thread reads what
// another one writes. Zones are convex cones, so that few walks within one leave it.
std::optional<std::vector<Vector>> Surface::InsertInZones(
    VertexTable& vertices, std::span<const Vector> points, uint32_t zones,
    const std::function<bool()>& should_stop) {
  std::vector<std::vector<Vector>> by_zone(zones);
  double largest = 0;
  for (const Vector& p : points) {
    by_zone[ZoneOf(directions_->center(), p, zones) - 1].push_back(p);
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
    extent_ = std::max(extent_, (p - directions_->center()).cwiseAbs().maxCoeff());
  }
  vertices.EnlargeMaxAbsCoordinate(largest);
  const double size = SizeWith(vertices, Vector::Constant(largest));

  std::vector<Editor> editors(zones);
  MarkZones(vertices, editors);
  // IDs are given out without touching what they stand for: that is left to the threads.
  for (uint32_t zone = 1; zone <= zones; ++zone) {
    Editor& editor = editors[zone - 1];
    editor.zone = zone;
    editor.mark = zone;
    // A point adds at most two triangles to those that are alive.
    editor.next = static_cast<TriangleId>(triangles_.size());
    for (size_t k = 0; k < 2 * by_zone[zone - 1].size(); ++k) triangles_.Extend();
    editor.end = static_cast<TriangleId>(triangles_.size());
    editor.vertices = vertices.AddZone(by_zone[zone - 1].size());
  }
  while (vertex_mark_.size() < vertices.id_bound()) vertex_mark_.push_back(0);

  std::vector<std::vector<Vector>> put_off(zones);
  std::atomic<bool> is_stopped = false;
#pragma omp parallel for num_threads(zones) schedule(static, 1)
  for (uint32_t k = 0; k < zones; ++k) {
    for (size_t i = 0; i < by_zone[k].size() && !is_stopped.load(std::memory_order_relaxed); ++i) {
      // Only the first zone asks: its thread is the caller's.
      if (k == 0 && i % kPointsPerPoll == 0 && should_stop && should_stop()) is_stopped = true;
      const Vector& p = by_zone[k][i];
      if (!InsertInZone(vertices, p, size, editors[k])) put_off[k].push_back(p);
    }
  }
  LeaveZones(vertices, editors);
  if (is_stopped) return std::nullopt;
  for (size_t k = 1; k < zones; ++k) {
    put_off[0].insert(put_off[0].end(), put_off[k].begin(), put_off[k].end());
  }
  return std::move(put_off[0]);
}

// Marks each triangle with its zone, 0 for none, and lets each zone start from one of its own.
void Surface::MarkZones(const VertexTable& vertices, std::span<Editor> zones) {
  ResetMarks();
  for (Editor& editor : zones) editor.last = kDead;
  ForEachTriangle([&](TriangleId id, const SurfaceTriangle& t) {
    uint32_t common = 0;
    for (const VertexId v : t.corners) {
      const uint32_t zone = ZoneOf(directions_->center(), vertices[v], zones.size());
      if (v == t.corners[0]) common = zone;
      if (zone != common) common = 0;
    }
    triangles_[id].mark = common;
    if (common != 0) zones[common - 1].last = id;
  });
}

// False when the insertion would change a triangle that is not of the zone.
bool Surface::InsertInZone(VertexTable& vertices, const Vector& point, double size, Editor& zone) {
  if (zone.last == kDead) return false;
  const std::optional<Location> location =
      Walk(vertices, point, size, zone.last, zone.zone, zone.work);
  if (!location) return false;
  if (location->side == Side::kInside) {
    const std::optional<VertexId> corner = CornerAt(vertices, location->triangle, point);
    if (corner) vertices.CountDuplicate(*corner, zone.vertices);
    zone.last = location->triangle;
    return true;
  }
  if (!CollectRegion(vertices, location->triangle, point, size, zone)) return false;
  RemoveVertices(vertices, zone);
  JoinHorizon(vertices, vertices.Add(point, zone.vertices), zone);
  return true;
}

void Surface::LeaveZones(VertexTable& vertices, std::span<Editor> zones) {
  for (Editor& editor : zones) {
    for (TriangleId id = editor.next; id < editor.end; ++id) {
      triangles_[id].corners[0] = kDead;
      triangles_[id].neighbours[0] = editor_.last;
      free_.push_back(id);
    }
    for (const TriangleId id : editor.free) free_.push_back(id);
    alive_ = static_cast<size_t>(static_cast<int64_t>(alive_) + editor.alive);
    work_ += editor.work;
    vertices.RemoveZone(editor.vertices);
    if (editor.last != kDead) editor_.last = editor.last;
  }
  ResetMarks();
}

}  // namespace hulld
