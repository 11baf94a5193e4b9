#include "core/hull/simplification/inside_search.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/hull/simplification/inside_order.h"
#include "core/hull/simplification/support_function.h"
#include "core/hull/simplification/unit_scale.h"
#include "core/hull/simplification/vertex_subset.h"

namespace hulld {
namespace {

// Number of moves of all vertices per attempt, and number of attempts. **Observed**: doubling
// either saves less than 2 % of the vertices.
constexpr int kMoves = 4;
constexpr int kAttempts = 3;

// Improves choices of vertices of a solid by spreading them more evenly.
class Spreading {
 public:
  Spreading(const Hull& hull, const UnitScale& scale, std::span<const Vector> unit_points,
            StopPoll& poll)
      : hull_(hull),
        scale_(scale),
        unit_points_(unit_points),
        poll_(poll),
        support_(hull, unit_points, poll) {}

  // Returns a choice better than the given one: close enough with fewer vertices, or closer.
  // Returns nothing if it finds none or the poll stopped. least: vertices that the choice starts
  // with.
  std::optional<VertexChoice> Improve(const VertexChoice& choice, double max_error,
                                      size_t least) const {
    const size_t count = choice.vertices.size();
    const std::span<const uint32_t> first = choice.vertices;
    std::optional<std::vector<uint32_t>> moved = Move(first.first(std::max(least, count * 7 / 8)));
    for (int k = 1; k < kMoves && moved; ++k) moved = Move(*moved);
    if (!moved) return std::nullopt;
    auto subset = VertexSubset::StartingWith(*moved, hull_.vertices(), unit_points_, poll_);
    if (!subset) return std::nullopt;
    const auto error = [&] { return scale_.LengthFromUnit(subset->DistanceBound()); };
    while (subset->chosen().size() < count && error() > max_error) {
      subset->ChooseNext(poll_);
      if (poll_.stopped()) return std::nullopt;
    }
    const bool is_better = choice.error <= max_error
                               ? error() <= max_error && subset->chosen().size() < count
                               : error() < choice.error;
    if (!is_better) return std::nullopt;
    return VertexChoice{subset->chosen(), error()};
  }

 private:
  std::optional<std::vector<uint32_t>> Move(std::span<const uint32_t> chosen) const;

  const Hull& hull_;
  const UnitScale& scale_;
  const std::span<const Vector> unit_points_;
  StopPoll& poll_;
  const SupportFunction support_;
};

// Moves each vertex and returns the distinct targets, in order. Returns nothing if the chosen
// vertices lie in a plane or the poll stopped.
std::optional<std::vector<uint32_t>> Spreading::Move(std::span<const uint32_t> chosen) const {
  const std::optional<Hull> inside = HullOfSubset(hull_, chosen, poll_);
  if (!inside || inside->dimension() < 3) return std::nullopt;
  const std::vector<uint32_t> places = PlacesOf(*inside, hull_);
  std::vector<Vector> points;
  points.reserve(places.size());
  for (const uint32_t place : places) points.push_back(unit_points_[place]);
  // Indexed by vertex of the whole hull.
  std::vector<Vector> normals(unit_points_.size(), Vector::Zero());
  for (size_t f = 0; f < inside->facet_count(); ++f) {
    if (poll_.Step()) return std::nullopt;
    const Vector normal = AreaNormal(points, inside->facet(f));
    for (const uint32_t v : inside->facet(f)) normals[places[v]] += normal;
  }
  std::vector<uint32_t> moved;
  std::vector<bool> is_taken(unit_points_.size(), false);
  for (const uint32_t i : chosen) {
    if (poll_.Step()) return std::nullopt;
    const uint32_t target = support_.FarthestAlong(normals[i], i);
    if (!is_taken[target]) moved.push_back(target);
    is_taken[target] = true;
  }
  return moved;
}

}  // namespace

VertexChoice ChooseInside(const Hull& hull, double max_error, size_t max_vertices, StopPoll& poll) {
  const UnitScale scale(hull.max_abs_coordinate());
  InsideOrder order(hull, scale, poll);
  if (poll.stopped()) return {};
  const size_t count = order.CountFor(max_error, max_vertices);
  VertexChoice choice = {order.First(count), order.ErrorAt(count)};
  // If a large part of the vertices is chosen, there is little to gain.
  if (poll.stopped() || hull.dimension() < 3 || 2 * count > hull.vertices().size()) return choice;
  if (choice.error <= max_error && count == order.least()) return choice;

  const Spreading spreading(hull, scale, order.unit_points(), poll);
  for (int k = 0; k < kAttempts && !poll.stopped(); ++k) {
    auto better = spreading.Improve(choice, max_error, order.least());
    if (!better) break;
    choice = *std::move(better);
  }
  return choice;
}

}  // namespace hulld
