#include "tests/bench/trade/trade_queries.h"

#include <cmath>
#include <cstdlib>
#include <iterator>

#include "core/hull/growth/hull_builder.h"
#include "core/query/collision.h"
#include "tests/bench/bench_random.h"

namespace hulld::bench {
namespace {

constexpr uint64_t kSeed = 20261121;

using Points = std::vector<Vector>;

Hull BuildHull(const Points& points) {
  HullBuilder builder;
  if (!builder.Add(points).ok()) std::abort();
  return builder.Snapshot();
}

Hull Rotated(const Hull& hull, const std::array<double, 4>& q) {
  const Eigen::Matrix3d R =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  Points points;
  for (const Vector& p : hull.vertices()) points.emplace_back(R * p);
  return BuildHull(points);
}

struct Level {
  // Relative distance to contact, uniform between the two; negative: deep.
  double least;
  double most;
  // If set, used instead: this fraction of the way from contact to coinciding centers.
  double inwards = 0;
  // Counted from the nearest translation that collides, not from the nearest that separates.
  bool from_collision = false;
};

constexpr Level kOrdinary[] = {{0.5, 2}, {0.01, 0.05}, {1e-3, 1e-3}, {0, 0, 0.5}, {-1e-3, -1e-3}};
constexpr Level kNearContact[] = {
    {-1e-6, -1e-6}, {1e-6, 1e-6},     {-1e-9, -1e-9}, {1e-9, 1e-9},    {-1e-12, -1e-12},
    {1e-12, 1e-12}, {-1e-15, -1e-15}, {1e-15, 1e-15}, {0, 0, 0, true}, {0, 0, 0, false}};
static_assert(std::size(kOrdinary) + std::size(kNearContact) == TradeQueries::kLevels);
// The last two of the ordinary levels, and the first near contact.
constexpr size_t kFirstDepthLevel = 3;
constexpr size_t kDepthLevels = 3;

// Returns B's translation for a pair at the level.
Vector Place(const QueryHull& a, const Vector& t_WA, const QueryHull& b, const Level& level,
             Random& random) {
  const Vector direction = random.UnitVector();
  const Vector start = t_WA + a.hull().center() - b.hull().center();
  const double reach = a.radius() + b.radius();
  Pose X_WA;
  X_WA.t = t_WA;
  const PlacedHull placed_a = *PlacedHull::Make(a, X_WA);
  double colliding = 0;
  double separated = 1.01 * reach;
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (colliding + separated);
    Pose X_WB;
    X_WB.t = start + middle * direction;
    const bool apart =
        CheckCollision(placed_a, *PlacedHull::Make(b, X_WB))->relation == Relation::kSeparated;
    (apart ? separated : colliding) = middle;
  }
  const double distance = (1 - level.inwards) * (level.from_collision ? colliding : separated) +
                          reach * random.Between(level.least, level.most);
  return start + distance * direction;
}

}  // namespace

TradeQueries MakeTradeQueries(const std::vector<Hull>& hulls, size_t per_level) {
  constexpr size_t kOrientations = 32;
  constexpr double kRadiiFromOrigin = 100;
  TradeQueries queries;
  Random random(kSeed);
  const size_t count = std::max(kOrientations, hulls.size());
  std::deque<QueryHull> query_hulls;
  double radii = 0;
  for (size_t i = 0; i < count; ++i) {
    queries.hulls.push_back(Rotated(hulls[i % hulls.size()], random.Rotation()));
    query_hulls.emplace_back(queries.hulls.back());
    radii += query_hulls.back().radius();
  }
  queries.size = radii / static_cast<double>(count);
  const auto add = [&](const Level& level) {
    for (size_t i = 0; i < per_level; ++i) {
      const size_t a = random.Below(count);
      const size_t b = random.Below(count);
      Pose X_WA;
      if (i % 2 == 1) X_WA.t = kRadiiFromOrigin * queries.size * random.UnitVector();
      Pose X_WB;
      X_WB.t = Place(query_hulls[a], X_WA.t, query_hulls[b], level, random);
      queries.queries.push_back({a, b, X_WA, X_WB});
    }
  };
  for (const Level& level : kOrdinary) add(level);
  for (const Level& level : kNearContact) add(level);
  queries.ordinary = {0, std::size(kOrdinary) * per_level};
  queries.near_contact = {queries.ordinary.count, std::size(kNearContact) * per_level};
  queries.depth = {kFirstDepthLevel * per_level, kDepthLevels * per_level};
  return queries;
}

std::vector<Hull> MakeOwnHulls() {
  constexpr int kOfAKind = 8;
  Random random(kSeed);
  std::vector<Hull> hulls;
  const auto length = [&] { return random.Between(0.5, 1.5); };
  for (int i = 0; i < kOfAKind; ++i) {
    const Vector axes(length(), length(), length());
    Points ellipsoid;
    for (int k = 0; k < 64; ++k) ellipsoid.push_back(random.UnitVector().cwiseProduct(axes));
    hulls.push_back(BuildHull(ellipsoid));

    const Vector half(length(), length(), length());
    Points box;
    for (int corner = 0; corner < 8; ++corner) {
      box.emplace_back((corner & 1) != 0 ? half.x() : -half.x(),
                       (corner & 2) != 0 ? half.y() : -half.y(),
                       (corner & 4) != 0 ? half.z() : -half.z());
    }
    hulls.push_back(BuildHull(box));

    constexpr int kSides = 12;
    const double radius = length();
    const double height = length();
    Points prism;
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * M_PI * k / kSides;
      prism.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
      prism.emplace_back(prism.back().x(), prism.back().y(), height);
    }
    hulls.push_back(BuildHull(prism));
  }
  return hulls;
}

}  // namespace hulld::bench
