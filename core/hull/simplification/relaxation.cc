#include "core/hull/simplification/relaxation.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/hull/simplification/subset_hull.h"

namespace hulld {
namespace {

// One vertex in this many is a candidate for removal, as one of the least protruding. About half of
// the candidates have a neighbor that protrudes even less, and stay.
constexpr size_t kVerticesPerFlat = 10;

}  // namespace

Relaxation::Relaxation(const Hull& hull, std::span<const Vector> unit_points, StopPoll& poll)
    : hull_(hull), unit_points_(unit_points), poll_(poll), support_(hull, unit_points, poll) {}

std::optional<std::vector<uint32_t>> Relaxation::Move(std::span<const uint32_t> chosen) {
  return Move(chosen, false);
}

std::optional<std::vector<uint32_t>> Relaxation::MoveFewer(std::span<const uint32_t> chosen) {
  return Move(chosen, true);
}

std::optional<std::vector<uint32_t>> Relaxation::Move(std::span<const uint32_t> chosen,
                                                      bool leave_out) {
  // In this order they are the vertices of the inside hull.
  const std::vector<uint32_t> places = Ascending(chosen);
  const std::optional<Hull> inside = HullOfSubset(hull_, places, poll_);
  if (!inside || inside->dimension() < 3) return std::nullopt;
  std::vector<Vector> points;
  points.reserve(places.size());
  for (const uint32_t place : places) points.push_back(unit_points_[place]);
  std::vector<Vector> normals(points.size(), Vector::Zero());
  for (size_t f = 0; f < inside->facet_count(); ++f) {
    if (poll_.Step()) return std::nullopt;
    const Vector normal = AreaNormal(points, inside->facet(f));
    for (const uint32_t v : inside->facet(f)) normals[v] += normal;
  }
  std::vector<bool> goes(points.size(), false);
  if (leave_out) goes = FindFlattest(*inside, points, normals);
  std::vector<uint32_t> moved;
  for (size_t v = 0; v < points.size(); ++v) {
    if (poll_.Step()) return std::nullopt;
    if (!goes[v]) moved.push_back(support_.FarthestAlong(normals[v], places[v]));
  }
  return Ascending(moved);
}

// Returns the vertices without duplicates. Avoids a sort, which could not poll.
std::vector<uint32_t> Relaxation::Ascending(std::span<const uint32_t> chosen) const {
  std::vector<bool> is_chosen(unit_points_.size(), false);
  for (const uint32_t i : chosen) is_chosen[i] = true;
  std::vector<uint32_t> ascending;
  ascending.reserve(chosen.size());
  for (uint32_t i = 0; i < is_chosen.size(); ++i) {
    if (is_chosen[i]) ascending.push_back(i);
  }
  return ascending;
}

// Finds vertices with about the least height above their neighbors' mean, no two of them
// neighbors.
std::vector<bool> Relaxation::FindFlattest(const Hull& inside, std::span<const Vector> points,
                                           std::span<const Vector> normals) {
  const size_t count = points.size();
  std::vector<Vector> sum(count, Vector::Zero());
  std::vector<int> neighbors(count, 0);
  for (const Edge& edge : inside.edges()) {
    sum[edge.tail] += points[edge.head];
    sum[edge.head] += points[edge.tail];
    ++neighbors[edge.tail];
    ++neighbors[edge.head];
  }
  std::vector<double> heights(count);
  for (size_t v = 0; v < count; ++v) {
    heights[v] = normals[v].stableNormalized().dot(points[v] - sum[v] / neighbors[v]);
  }
  std::vector<double> least = heights;
  const auto last = least.begin() + static_cast<ptrdiff_t>(count / kVerticesPerFlat);
  std::nth_element(least.begin(), last, least.end());
  std::vector<bool> goes(count);
  for (size_t v = 0; v < count; ++v) goes[v] = heights[v] <= *last;
  for (const Edge& edge : inside.edges()) {
    const bool is_tail_lower = heights[edge.tail] <= heights[edge.head];
    goes[is_tail_lower ? edge.head : edge.tail] = false;
  }
  return goes;
}

}  // namespace hulld
