#include "core/query/exact/exact_nearest.h"

#include <absl/status/status.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "core/base/stop_poll.h"

namespace hulld {
namespace {

// A part of a simplex. The weights, all positive, are those of the point of its affine hull that is
// nearest to the origin.
struct SimplexFace {
  std::vector<ExactCorner> corners;
  std::vector<Integer> weights;
  Integer weight_sum;
  // A positive multiple of the vector from that point to the origin; zero if the point is the
  // origin.
  IntegerVector toward_origin;
  Integer numerator;
  Integer denominator;
};

bool AllPositive(const std::vector<Integer>& weights) {
  return std::all_of(weights.begin(), weights.end(), [](const Integer& w) { return Sign(w) > 0; });
}

// The functions below return nothing if the corners are affinely dependent, or if the nearest point
// of their affine hull is not strictly between them.

std::optional<SimplexFace> PartOf(const ExactCorner& p) {
  return SimplexFace{{p}, {1}, 1, -p.w, Dot(p.w, p.w), 1};
}

std::optional<SimplexFace> PartOf(const ExactCorner& p, const ExactCorner& q) {
  const IntegerVector e = q.w - p.w;
  std::vector<Integer> weights = {Dot(q.w, e), -Dot(p.w, e)};
  if (!AllPositive(weights)) return std::nullopt;
  const IntegerVector moment = Cross(p.w, q.w);
  IntegerVector toward = -(weights[0] * p.w + weights[1] * q.w);
  Integer length = Dot(e, e);
  return SimplexFace{{p, q}, std::move(weights), length, std::move(toward), Dot(moment, moment),
                     length};
}

std::optional<SimplexFace> PartOf(const ExactCorner& p, const ExactCorner& q,
                                  const ExactCorner& r) {
  const IntegerVector n = Cross(q.w - p.w, r.w - p.w);
  std::vector<Integer> weights = {Dot(n, Cross(q.w, r.w)), Dot(n, Cross(r.w, p.w)),
                                  Dot(n, Cross(p.w, q.w))};
  if (!AllPositive(weights)) return std::nullopt;
  const Integer height = Dot(n, p.w);
  const int side = Sign(height);
  const IntegerVector toward = side == 0 ? IntegerVector{0, 0, 0} : side > 0 ? -n : n;
  const Integer area = Dot(n, n);
  return SimplexFace{{p, q, r}, std::move(weights), area, toward, height * height, area};
}

std::optional<SimplexFace> PartOf(const ExactCorner& p, const ExactCorner& q, const ExactCorner& r,
                                  const ExactCorner& s) {
  const auto volume = [](const ExactCorner& u, const ExactCorner& v, const ExactCorner& w) {
    return Dot(u.w, Cross(v.w, w.w));
  };
  std::vector<Integer> weights = {volume(q, s, r), volume(p, r, s), volume(p, s, q),
                                  volume(p, q, r)};
  if (Sign(weights[0]) < 0) {
    for (Integer& weight : weights) weight = -weight;
  }
  if (!AllPositive(weights)) return std::nullopt;
  Integer sum = weights[0] + weights[1] + weights[2] + weights[3];
  return SimplexFace{{p, q, r, s}, std::move(weights), std::move(sum), {0, 0, 0}, 0, 1};
}

std::optional<SimplexFace> PartOf(const std::vector<ExactCorner>& c) {
  switch (c.size()) {
    case 1:
      return PartOf(c[0]);
    case 2:
      return PartOf(c[0], c[1]);
    case 3:
      return PartOf(c[0], c[1], c[2]);
    case 4:
      return PartOf(c[0], c[1], c[2], c[3]);
    default:
      HULLD_UNREACHABLE();
  }
}

// Returns true if no corner is nearer to the origin than the part, along the direction to the
// origin.
bool IsNearest(const SimplexFace& part, const std::vector<ExactCorner>& corners) {
  const Integer reach = Dot(part.toward_origin, part.corners[0].w);
  return std::all_of(corners.begin(), corners.end(), [&](const ExactCorner& corner) {
    return Dot(part.toward_origin, corner.w) <= reach;
  });
}

// Returns the part of the simplex that contains the point nearest to the origin in its interior.
// One exists, with affinely independent corners, even if the corners of the simplex are dependent
// (Caratheodory).
SimplexFace NearestPart(const std::vector<ExactCorner>& corners) {
  for (uint32_t size = 1; size <= corners.size(); ++size) {
    for (uint32_t subset = 1; subset < (1u << corners.size()); ++subset) {
      if (static_cast<uint32_t>(__builtin_popcount(subset)) != size) continue;
      std::vector<ExactCorner> chosen;
      for (size_t i = 0; i < corners.size(); ++i) {
        if (subset >> i & 1) chosen.push_back(corners[i]);
      }
      std::optional<SimplexFace> part = PartOf(chosen);
      if (part && IsNearest(*part, corners)) return *std::move(part);
    }
  }
  HULLD_UNREACHABLE();
}

}  // namespace

IntegerVector PointOf(ExactPair& pair, const ExactCombination& combination) {
  IntegerVector point = {0, 0, 0};
  for (size_t i = 0; i < combination.pairs.size(); ++i) {
    point = point + combination.weights[i] * pair.Difference(combination.pairs[i]);
  }
  return point;
}

absl::StatusOr<ExactNearest> FindNearestExactly(ExactPair& pair, std::span<const VertexPair> seed,
                                                const std::function<bool()>& should_stop,
                                                const IntegerVector* half) {
  HULLD_CHECK(seed.size() <= 4);
  std::vector<ExactCorner> corners;
  for (const VertexPair& p : seed) corners.push_back(pair.Corner(p));
  if (corners.empty()) corners.push_back(pair.Corner({0, 0}));
  StopPoll poll(should_stop, 1);
  for (;;) {
    if (poll.Step()) return absl::CancelledError("the exact query was cancelled");
    SimplexFace part = NearestPart(corners);
    const IntegerVector& n = part.toward_origin;
    if (!IsZero(n)) {
      ExactCorner farthest = pair.Farthest(n);
      if (half != nullptr) {
        farthest.w = Sign(Dot(n, *half)) < 0 ? farthest.w - *half : farthest.w + *half;
      }
      if (pair.stopped()) return absl::CancelledError("the exact query was cancelled");
      if (Dot(n, farthest.w) > Dot(n, part.corners[0].w)) {
        corners = std::move(part.corners);
        corners.push_back(std::move(farthest));
        continue;
      }
    }
    ExactNearest nearest{{{}, std::move(part.weights), std::move(part.weight_sum)},
                         std::move(part.numerator),
                         std::move(part.denominator)};
    for (const ExactCorner& c : part.corners) nearest.point.pairs.push_back(c.pair);
    return nearest;
  }
}

}  // namespace hulld
