#include "core/hull/audit.h"

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/integer.h"

namespace hulld {
namespace {

// Integers exactly proportional to the points' coordinates.
struct IntegerPoints {
  int exponent;
  std::vector<IntegerVector> points;
};

// The result is incomplete if stopped.
IntegerPoints ToIntegers(std::span<const Vector> points, std::span<const Vector> also,
                         StopPoll& poll) {
  int exponent = kAboveAllExponents;
  for (const Vector& p : points) exponent = LowestBitExponent(p, exponent);
  for (const Vector& p : also) exponent = LowestBitExponent(p, exponent);
  IntegerPoints result{exponent, {}};
  result.points.reserve(points.size());
  for (const Vector& p : points) {
    if (poll.Step()) break;
    result.points.push_back(ToInteger(p, exponent));
  }
  return result;
}

template <typename... Parts>
absl::Status Finding(const Parts&... parts) {
  return absl::InternalError(absl::StrCat(parts...));
}

absl::Status Stopped() { return absl::CancelledError("the audit was cancelled"); }

absl::Status CheckVertices(const Hull& hull, StopPoll& poll) {
  const std::span<const Vector> v = hull.vertices();
  for (size_t i = 0; i < v.size(); ++i) {
    if (poll.Step()) return Stopped();
    for (int k = 0; k < 3; ++k) {
      if (!std::isfinite(v[i][k])) return Finding("vertex ", i, " is not finite");
      if (v[i][k] == 0 && std::signbit(v[i][k])) return Finding("vertex ", i, " has -0");
    }
    if (i > 0 &&
        !std::lexicographical_compare(v[i - 1].begin(), v[i - 1].end(), v[i].begin(), v[i].end())) {
      return Finding("vertices ", i - 1, " and ", i, " are out of order");
    }
  }
  return absl::OkStatus();
}

// Returns the unnormalized normal of a facet at its first corner; zero if the corner is straight.
// Requires: at least three corners.
IntegerVector NormalOf(const std::vector<IntegerVector>& v, std::span<const uint32_t> facet) {
  HULLD_CHECK(facet.size() >= 3);
  return Cross(v[facet[1]] - v[facet[0]], v[facet[2]] - v[facet[0]]);
}

absl::Status CheckFacet(const std::vector<IntegerVector>& v, std::span<const uint32_t> facet,
                        size_t index, StopPoll& poll) {
  const size_t n = facet.size();
  if (n < 3) return Finding("facet ", index, " has fewer than three vertices");
  for (const uint32_t u : facet) {
    if (u >= v.size())
      return Finding("facet ", index, " names vertex ", u, ", which does not exist");
  }
  if (*std::min_element(facet.begin(), facet.end()) != facet[0]) {
    return Finding("facet ", index, " does not start at its lowest vertex");
  }
  const IntegerVector normal = NormalOf(v, facet);
  for (size_t i = 0; i < n; ++i) {
    if (poll.Step()) return Stopped();
    const IntegerVector& a = v[facet[i]];
    const IntegerVector& b = v[facet[(i + 1) % n]];
    const IntegerVector& c = v[facet[(i + 2) % n]];
    if (Sign(Dot(normal, a - v[facet[0]])) != 0) return Finding("facet ", index, " is not planar");
    if (Sign(Dot(normal, Cross(b - a, c - b))) <= 0) {
      return Finding("facet ", index, " is not strictly convex");
    }
    const bool in_fan = i >= 1 && i + 1 < n;
    if (in_fan && Sign(Dot(normal, Cross(a - v[facet[0]], b - v[facet[0]]))) <= 0) {
      return Finding("facet ", index, " winds more than once");
    }
  }
  return absl::OkStatus();
}

// A directed edge of a facet: from its corner number `corner` to the next.
struct Side {
  uint32_t tail;
  uint32_t head;
  uint32_t facet;
  uint32_t corner;
};

// Sorts by a vertex index, below `count`; stable. The result is incomplete if stopped. Cost:
// O(sides + count).
template <typename VertexOf>
std::vector<Side> SortedBy(VertexOf vertex_of, const std::vector<Side>& sides, size_t count,
                           StopPoll& poll) {
  std::vector<uint32_t> starts(count + 1, 0);
  for (const Side& side : sides) {
    if (poll.Step()) return {};
    ++starts[vertex_of(side) + 1];
  }
  for (size_t i = 0; i < count && !poll.Step(); ++i) starts[i + 1] += starts[i];
  std::vector<Side> sorted(sides.size());
  for (const Side& side : sides) {
    if (poll.Step()) return {};
    sorted[starts[vertex_of(side)]++] = side;
  }
  return sorted;
}

// An edge between two facets, as a side of each.
struct SharedEdge {
  Side left;
  Side right;
};

// Returns every side, sorted by tail and head, with the opposite side of the neighboring facet,
// which is at the same position in the order by head and tail.
absl::StatusOr<std::vector<SharedEdge>> CheckManifold(const Hull& hull, StopPoll& poll) {
  const size_t count = hull.vertices().size();
  std::vector<Side> sides;
  for (uint32_t f = 0; f < hull.facet_count(); ++f) {
    const std::span<const uint32_t> facet = hull.facet(f);
    for (uint32_t i = 0; i < facet.size(); ++i) {
      if (poll.Step()) return Stopped();
      sides.push_back({facet[i], facet[(i + 1) % facet.size()], f, i});
    }
  }
  const auto tail = [](const Side& side) { return side.tail; };
  const auto head = [](const Side& side) { return side.head; };
  const std::vector<Side> by_tail = SortedBy(tail, SortedBy(head, sides, count, poll), count, poll);
  if (poll.stopped()) return Stopped();
  const std::vector<Side> by_head = SortedBy(head, SortedBy(tail, sides, count, poll), count, poll);
  if (poll.stopped()) return Stopped();
  std::vector<SharedEdge> shared;
  shared.reserve(sides.size());
  size_t edges = 0;
  for (size_t k = 0; k < sides.size(); ++k) {
    if (poll.Step()) return Stopped();
    const Side& left = by_tail[k];
    const Side& right = by_head[k];
    if (k > 0 && by_tail[k - 1].tail == left.tail && by_tail[k - 1].head == left.head) {
      return Finding("edge ", left.tail, "-", left.head, " is used twice in one direction");
    }
    if (left.tail != right.head || left.head != right.tail) {
      return Finding("edge ", left.tail, "-", left.head, " or ", right.tail, "-", right.head,
                     " bounds one facet only");
    }
    shared.push_back({left, right});
    if (left.tail > left.head) continue;
    if (edges >= hull.edges().size() || hull.edges()[edges] != Edge{left.tail, left.head}) {
      return Finding("the edges are not those of the facets, sorted");
    }
    ++edges;
  }
  if (edges != hull.edges().size()) return Finding("the edges are not those of the facets, sorted");
  return shared;
}

absl::Status CheckConnected(const Hull& hull, const std::vector<SharedEdge>& shared,
                            StopPoll& poll) {
  std::vector<size_t> parent(hull.facet_count());
  std::iota(parent.begin(), parent.end(), size_t{0});
  const auto root = [&](size_t f) {
    while (parent[f] != f) f = parent[f] = parent[parent[f]];
    return f;
  };
  std::vector<char> used(hull.vertices().size(), 0);
  for (const auto& [left, right] : shared) {
    if (poll.Step()) return Stopped();
    parent[root(left.facet)] = root(right.facet);
    used[left.tail] = 1;
  }
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    if (poll.Step()) return Stopped();
    if (root(f) != root(0)) return Finding("the surface is in several pieces");
  }
  if (std::find(used.begin(), used.end(), 0) != used.end()) {
    return Finding("a vertex is on no facet");
  }
  const auto characteristic = static_cast<int64_t>(hull.vertices().size()) -
                              static_cast<int64_t>(hull.edges().size()) +
                              static_cast<int64_t>(hull.facet_count());
  if (characteristic != 2) return Finding("V - E + F is ", characteristic, ", not 2");
  return absl::OkStatus();
}

// Checks that the neighbor of every facet across every edge bends strictly inwards.
absl::Status CheckLocalConvexity(const std::vector<IntegerVector>& v, const Hull& hull,
                                 const std::vector<SharedEdge>& shared, StopPoll& poll) {
  for (const auto& [left, right] : shared) {
    if (poll.Step()) return Stopped();
    const std::span<const uint32_t> other = hull.facet(right.facet);
    const IntegerVector& beyond = v[other[(right.corner + 2) % other.size()]];
    if (Sign(Dot(NormalOf(v, hull.facet(left.facet)), beyond - v[left.tail])) >= 0) {
      return Finding("edge ", left.tail, "-", left.head, " is not strictly convex");
    }
  }
  return absl::OkStatus();
}

// Checks that a point lies below all facets and that a ray from it meets the surface once. A
// closed, locally convex surface with this property is convex. Coordinates are multiplied by the
// number of vertices, so that their mean is an integer.
absl::Status CheckGlobalConvexity(const std::vector<IntegerVector>& v, const Hull& hull,
                                  StopPoll& poll) {
  const Integer count = v.size();
  IntegerVector mean = {0, 0, 0};
  for (const IntegerVector& p : v) {
    if (poll.Step()) return Stopped();
    mean = mean + p;
  }
  const auto from_mean = [&](uint32_t u) { return count * v[u] - mean; };

  IntegerVector ray = {0, 0, 0};
  for (const uint32_t u : hull.facet(0)) {
    if (poll.Step()) return Stopped();
    ray = ray + from_mean(u);
  }
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    const std::span<const uint32_t> facet = hull.facet(f);
    if (Sign(Dot(NormalOf(v, facet), from_mean(facet[0]))) <= 0) {
      return Finding("the mean of the vertices is not below facet ", f);
    }
    bool pierced = true;
    for (size_t i = 0; i < facet.size() && pierced; ++i) {
      if (poll.Step()) return Stopped();
      const IntegerVector side =
          Cross(from_mean(facet[i]), from_mean(facet[(i + 1) % facet.size()]));
      pierced = Sign(Dot(side, ray)) >= 0;
    }
    if (pierced != (f == 0)) return Finding("a ray from inside meets facets 0 and ", f);
  }
  return absl::OkStatus();
}

absl::Status AuditSolid(const std::vector<IntegerVector>& v, const Hull& hull, StopPoll& poll) {
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    if (absl::Status s = CheckFacet(v, hull.facet(f), f, poll); !s.ok()) return s;
    if (f > 0 && !std::lexicographical_compare(hull.facet(f - 1).begin(), hull.facet(f - 1).end(),
                                               hull.facet(f).begin(), hull.facet(f).end())) {
      return Finding("facets ", f - 1, " and ", f, " are out of order");
    }
  }
  if (hull.facet_count() < 4) return Finding("a solid has at least four facets");
  const absl::StatusOr<std::vector<SharedEdge>> shared = CheckManifold(hull, poll);
  if (!shared.ok()) return shared.status();
  if (absl::Status s = CheckConnected(hull, *shared, poll); !s.ok()) return s;
  if (absl::Status s = CheckLocalConvexity(v, hull, *shared, poll); !s.ok()) return s;
  return CheckGlobalConvexity(v, hull, poll);
}

absl::Status AuditPolygon(const std::vector<IntegerVector>& v, const Hull& hull, StopPoll& poll) {
  if (hull.facet_count() != 1 || hull.facet(0).size() != v.size()) {
    return Finding("a polygon has one facet, with all vertices");
  }
  const std::span<const uint32_t> facet = hull.facet(0);
  if (absl::Status s = CheckFacet(v, facet, 0, poll); !s.ok()) return s;
  if (facet[1] > facet.back()) return Finding("the polygon is not in its canonical orientation");
  // Position in the loop, by vertex. If a vertex occurs twice, another vertex has no position.
  std::vector<size_t> places(v.size(), SIZE_MAX);
  for (size_t i = 0; i < facet.size(); ++i) {
    if (poll.Step()) return Stopped();
    places[facet[i]] = i;
  }
  if (hull.edges().size() != v.size()) return Finding("a polygon has as many edges as vertices");
  for (size_t k = 0; k < v.size(); ++k) {
    if (poll.Step()) return Stopped();
    const Edge& edge = hull.edges()[k];
    bool is_good = edge.tail < edge.head && edge.head < v.size();
    is_good = is_good && (k == 0 || hull.edges()[k - 1] < edge);
    if (is_good) {
      const size_t steps = (places[edge.head] + v.size() - places[edge.tail]) % v.size();
      is_good = steps == 1 || steps + 1 == v.size();
    }
    if (!is_good) return Finding("the edges are not those of the polygon, sorted");
  }
  return absl::OkStatus();
}

absl::Status AuditEnds(const Hull& hull) {
  const size_t expected = static_cast<size_t>(hull.dimension() + 1);
  if (hull.vertices().size() != expected) return Finding("wrong number of vertices");
  if (hull.facet_count() != 0) return Finding("facets on a hull of dimension below 2");
  if (hull.edges().size() != (expected == 2 ? 1u : 0u)) return Finding("wrong number of edges");
  if (expected == 2 && hull.edges()[0] != Edge{0, 1}) return Finding("the edge is not 0-1");
  return absl::OkStatus();
}

// Returns true if the point is certainly below the facet, in doubles; false if that is uncertain.
class FacetFilter {
 public:
  FacetFilter(const IntegerVector& normal, const Vector& origin)
      : normal_(ToScaledDoubles(normal)), origin_(origin) {}
  bool IsSurelyBelow(const Vector& point) const {
    const Vector offset = point - origin_;
    const double size = offset.cwiseAbs().sum();
    return size > kAuditMinOffset && size < kAuditMaxOffset &&
           normal_.dot(offset) < -kAuditErrorFactor * kScaledDoublesMax * size;
  }

 private:
  Vector normal_;
  Vector origin_;
};

absl::Status SolidContainment(const IntegerPoints& v, const Hull& hull,
                              std::span<const Vector> points) {
  for (size_t f = 0; f < hull.facet_count(); ++f) {
    const std::span<const uint32_t> facet = hull.facet(f);
    const IntegerVector normal = NormalOf(v.points, facet);
    const FacetFilter filter(normal, hull.vertices()[facet[0]]);
    for (size_t i = 0; i < points.size(); ++i) {
      if (filter.IsSurelyBelow(points[i])) continue;
      const IntegerVector p = ToInteger(points[i], v.exponent);
      if (Sign(Dot(normal, p - v.points[facet[0]])) > 0) {
        return Finding("points[", i, "] is outside facet ", f);
      }
    }
  }
  return absl::OkStatus();
}

bool PolygonContains(const std::vector<IntegerVector>& v, std::span<const uint32_t> facet,
                     const IntegerVector& p) {
  const IntegerVector normal = NormalOf(v, facet);
  if (Sign(Dot(normal, p - v[facet[0]])) != 0) return false;
  for (size_t i = 0; i < facet.size(); ++i) {
    const IntegerVector& a = v[facet[i]];
    const IntegerVector& b = v[facet[(i + 1) % facet.size()]];
    if (Sign(Dot(normal, Cross(b - a, p - a))) < 0) return false;
  }
  return true;
}

bool SegmentContains(const IntegerVector& a, const IntegerVector& b, const IntegerVector& p) {
  const IntegerVector u = b - a;
  return IsZero(Cross(u, p - a)) && Sign(Dot(u, p - a)) >= 0 && Sign(Dot(u, b - p)) >= 0;
}

bool FlatContains(const std::vector<IntegerVector>& v, const Hull& hull, const IntegerVector& p) {
  switch (hull.dimension()) {
    case 2:
      return PolygonContains(v, hull.facet(0), p);
    case 1:
      return SegmentContains(v[0], v[1], p);
    case 0:
      return v[0] == p;
    case -1:
      return false;
  }
  HULLD_UNREACHABLE();
}

}  // namespace

absl::Status AuditHull(const Hull& hull, const std::function<bool()>& should_stop) {
  StopPoll poll(should_stop);
  if (absl::Status s = CheckVertices(hull, poll); !s.ok()) return s;
  if (hull.dimension() < 2) return AuditEnds(hull);
  const IntegerPoints v = ToIntegers(hull.vertices(), {}, poll);
  if (poll.stopped()) return Stopped();
  return hull.dimension() == 2 ? AuditPolygon(v.points, hull, poll)
                               : AuditSolid(v.points, hull, poll);
}

absl::Status AuditContainment(const Hull& hull, std::span<const Vector> points) {
  StopPoll poll;
  const IntegerPoints v = ToIntegers(hull.vertices(), points, poll);
  if (hull.dimension() == 3) return SolidContainment(v, hull, points);
  for (size_t i = 0; i < points.size(); ++i) {
    if (!FlatContains(v.points, hull, ToInteger(points[i], v.exponent))) {
      return Finding("points[", i, "] is outside");
    }
  }
  return absl::OkStatus();
}

}  // namespace hulld
