#include "core/hull/simplification/subset_hull.h"

#include <absl/status/statusor.h>

#include <cstddef>
#include <utility>

#include "core/base/check.h"
#include "core/hull/growth/hull_builder.h"

namespace hulld {

std::optional<Hull> HullOfSubset(const Hull& full, std::span<const uint32_t> chosen,
                                 StopPoll& poll) {
  const auto should_stop = [&poll] { return poll.Poll(); };
  std::vector<Vector> points;
  points.reserve(chosen.size());
  for (const uint32_t i : chosen) points.push_back(full.vertices()[i]);
  HullBuilder builder;
  if (!builder.Add(points, {.should_stop = should_stop}).ok()) return std::nullopt;
  absl::StatusOr<Hull> hull = builder.Snapshot(should_stop);
  if (!hull.ok()) return std::nullopt;
  HULLD_CHECK(hull->vertices().size() == chosen.size());
  return *std::move(hull);
}

std::vector<uint32_t> PlacesOf(const Hull& inside, const Hull& full) {
  std::vector<uint32_t> places;
  places.reserve(inside.vertices().size());
  // Both are sorted.
  uint32_t place = 0;
  for (const Vector& v : inside.vertices()) {
    while (full.vertices()[place] != v) ++place;
    places.push_back(place);
  }
  return places;
}

Vector AreaNormal(std::span<const Vector> points, std::span<const uint32_t> loop) {
  Vector sum = Vector::Zero();
  const Vector& a = points[loop[0]];
  for (size_t i = 1; i + 1 < loop.size(); ++i) {
    sum += (points[loop[i]] - a).cross(points[loop[i + 1]] - a);
  }
  return sum;
}

}  // namespace hulld
