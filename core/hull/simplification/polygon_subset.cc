#include "core/hull/simplification/polygon_subset.h"

#include <algorithm>
#include <array>

#include "core/base/check.h"
#include "core/hull/simplification/triangle_distance.h"

namespace hulld {

PolygonSubset::PolygonSubset(std::span<const Vector> points, std::span<const uint32_t> loop,
                             StopPoll& poll)
    : points_(points), loop_(loop) {
  HULLD_CHECK(loop.size() >= 3);
  // The vertex farthest from the first, and the vertex farthest from both ends of that edge: any
  // three vertices form a triangle.
  const auto farthest_from = [&](size_t a, size_t b) {
    size_t farthest = 0;
    double largest = -1;
    for (size_t place = 0; place < loop_.size() && !poll.Step(); ++place) {
      if (place == a || place == b) continue;
      const double distance = DistanceToTriangleBound(points_[At(a)], points_[At(b)],
                                                      points_[At(b)], points_[At(place)]);
      if (distance > largest) {
        largest = distance;
        farthest = place;
      }
    }
    return farthest;
  };
  const size_t second = farthest_from(0, 0);
  const size_t third = farthest_from(0, second);
  std::array<size_t, 3> places = {0, second, third};
  for (const size_t place : places) chosen_.push_back(At(place));
  std::sort(places.begin(), places.end());
  for (size_t i = 0; i < 3; ++i) {
    const size_t last = i == 2 ? loop_.size() : places[i + 1];
    arcs_.push(ArcBetween(places[i], last, poll));
  }
}

void PolygonSubset::ChooseNext(StopPoll& poll) {
  HULLD_CHECK(!is_complete());
  const Arc arc = arcs_.top();
  arcs_.pop();
  chosen_.push_back(At(arc.farthest));
  arcs_.push(ArcBetween(arc.first, arc.farthest, poll));
  arcs_.push(ArcBetween(arc.farthest, arc.last, poll));
}

PolygonSubset::Arc PolygonSubset::ArcBetween(size_t first, size_t last, StopPoll& poll) const {
  Arc arc = {0, 0, first, last};
  const Vector& a = points_[At(first)];
  const Vector& b = points_[At(last)];
  for (size_t place = first + 1; place < last && !poll.Step(); ++place) {
    const double distance = DistanceToTriangleBound(a, b, b, points_[At(place)]);
    if (distance > arc.distance) {
      arc.distance = distance;
      arc.farthest = place;
    }
  }
  return arc;
}

}  // namespace hulld
