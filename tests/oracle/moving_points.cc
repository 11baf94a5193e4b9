#include "tests/oracle/moving_points.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tests/oracle/origin_position.h"

namespace hulld::oracle {
namespace {

using RationalVector = std::array<Rational, 3>;

Rational Product(const RationalVector& a, const RationalVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// A pose at a time: p_W = rows p / norm + x.
struct PoseAt {
  std::array<RationalVector, 3> rows;
  Rational norm;
  RationalVector x;
};

PoseAt At(const Motion& motion, const Rational& t) {
  Rational q[4];
  for (int i = 0; i < 4; ++i) {
    q[i] = (1 - t) * Rational(motion.start.q[i]) + t * Rational(motion.end.q[i]);
  }
  const auto& [w, x, y, z] = q;
  PoseAt pose;
  pose.norm = w * w + x * x + y * y + z * z;
  pose.rows = {
      RationalVector{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
      RationalVector{2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
      RationalVector{2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
  for (int i = 0; i < 3; ++i) {
    pose.x[i] = (1 - t) * Rational(motion.start.t[i]) + t * Rational(motion.end.t[i]);
  }
  return pose;
}

RationalVector Placed(const PoseAt& pose, const RationalVector& p) {
  RationalVector placed;
  for (int i = 0; i < 3; ++i) placed[i] = Product(pose.rows[i], p) / pose.norm + pose.x[i];
  return placed;
}

std::vector<RationalVector> AllPlaced(const MovingPoints& moving, const Rational& t) {
  const PoseAt pose = At(moving.motion, t);
  const PoseAt in_frame = At({moving.in_frame, moving.in_frame}, 0);
  std::vector<RationalVector> placed;
  for (const Point& p : moving.points) {
    const RationalVector own = {Rational(p[0]), Rational(p[1]), Rational(p[2])};
    placed.push_back(Placed(pose, Placed(in_frame, own)));
  }
  return placed;
}

// Scales points to integers by a common factor.
Integer CommonDenominator(std::span<const RationalVector> points) {
  Integer scale = 1;
  for (const RationalVector& p : points) {
    for (const Rational& x : p) scale = lcm(scale, Integer(denominator(x)));
  }
  return scale;
}

IntegerVector Scaled(const RationalVector& p, const Integer& scale) {
  IntegerVector scaled;
  for (int i = 0; i < 3; ++i) {
    scaled[i] = Integer(numerator(p[i])) * (scale / Integer(denominator(p[i])));
  }
  return scaled;
}

OriginPosition PositionAt(std::span<const RationalVector> differences, const RationalVector& step,
                          const Rational& t) {
  std::vector<RationalVector> shifted;
  for (const RationalVector& w : differences) {
    shifted.push_back({w[0] - t * step[0], w[1] - t * step[1], w[2] - t * step[2]});
  }
  const Integer scale = CommonDenominator(shifted);
  std::vector<IntegerVector> points;
  for (const RationalVector& w : shifted) points.push_back(Scaled(w, scale));
  const std::vector<IntegerVector> origin = {{0, 0, 0}};
  return LocateInDifference(points, origin);
}

// Adds each time in [0, 1] at which t d crosses a point, or the line or plane of two or three of
// the points.
void AddEvents(std::span<const IntegerVector> points, const IntegerVector& d,
               std::set<Rational>& events) {
  const auto add = [&](const Integer& numerator, const Integer& denominator) {
    if (denominator == 0) return;
    const Rational t = Rational(numerator) / Rational(denominator);
    if (t >= 0 && t <= 1) events.insert(t);
  };
  for (size_t i = 0; i < points.size(); ++i) {
    add(Dot(points[i], d), Dot(d, d));
    for (size_t j = i + 1; j < points.size(); ++j) {
      // t d x e = p x e for a point p and the direction e of a line.
      const IntegerVector e = Subtract(points[j], points[i]);
      const IntegerVector across = Cross(d, e);
      add(Dot(Cross(points[i], e), across), Dot(across, across));
      for (size_t k = j + 1; k < points.size(); ++k) {
        const IntegerVector n = Cross(e, Subtract(points[k], points[i]));
        add(Dot(n, points[i]), Dot(n, d));
      }
    }
  }
}

}  // namespace

WorldPoints PlaceInWorldAt(const MovingPoints& a, const MovingPoints& b, const Rational& time) {
  std::vector<RationalVector> all = AllPlaced(a, time);
  const size_t count_a = all.size();
  for (const RationalVector& p : AllPlaced(b, time)) all.push_back(p);
  const Integer scale = CommonDenominator(all);
  WorldPoints world;
  for (size_t i = 0; i < all.size(); ++i) {
    (i < count_a ? world.a : world.b).push_back(Scaled(all[i], scale));
  }
  return world;
}

Relation RelationAt(const MovingPoints& a, const MovingPoints& b, const Rational& time) {
  const WorldPoints world = PlaceInWorldAt(a, b, time);
  return world.a.size() * world.b.size() <= 36 ? RelationByPolarCone(world)
                                               : RelationByLinearProgram(world);
}

TranslationContact BruteForceTranslation(const MovingPoints& a, const MovingPoints& b) {
  std::vector<RationalVector> differences;
  for (const RationalVector& p : AllPlaced(a, 0)) {
    for (const RationalVector& q : AllPlaced(b, 0)) {
      differences.push_back({p[0] - q[0], p[1] - q[1], p[2] - q[2]});
    }
  }
  std::sort(differences.begin(), differences.end());
  differences.erase(std::unique(differences.begin(), differences.end()), differences.end());
  RationalVector step;
  for (int i = 0; i < 3; ++i) {
    step[i] = (Rational(b.motion.end.t[i]) - Rational(b.motion.start.t[i])) -
              (Rational(a.motion.end.t[i]) - Rational(a.motion.start.t[i]));
  }
  std::vector<RationalVector> all = differences;
  all.push_back(step);
  const Integer scale = CommonDenominator(all);
  std::vector<IntegerVector> points;
  for (const RationalVector& w : differences) points.push_back(Scaled(w, scale));
  std::set<Rational> events = {0, 1};
  AddEvents(points, Scaled(step, scale), events);

  TranslationContact contact;
  std::optional<Rational> previous;
  for (const Rational& t : events) {
    if (previous && PositionAt(differences, step, (*previous + t) / 2) == OriginPosition::kInside) {
      contact.relation = Relation::kOverlapping;
    }
    const OriginPosition position = PositionAt(differences, step, t);
    previous = t;
    if (position == OriginPosition::kOutside) continue;
    if (!contact.first) contact.first = t;
    if (contact.relation == Relation::kSeparated) contact.relation = Relation::kTouching;
    if (position == OriginPosition::kInside) contact.relation = Relation::kOverlapping;
    if (contact.relation == Relation::kOverlapping) break;
  }
  return contact;
}

namespace {

// Returns n.p over all points at a time.
std::vector<Rational> ValuesAt(const MovingPoints& moving, const SeparatedInterval& interval,
                               const Rational& t) {
  std::vector<Rational> values;
  for (const RationalVector& p : AllPlaced(moving, t)) {
    values.push_back(Product(interval.direction, p));
  }
  return values;
}

// Returns |q|^2 (n.p - offset) over all points, at a share of the interval from `from` on.
std::vector<Rational> HeightsAt(const MovingPoints& moving, const SeparatedInterval& interval,
                                const Rational& from, const Rational& share) {
  const Rational t = from + share * (interval.until - from);
  RationalVector n;
  for (int i = 0; i < 3; ++i) {
    n[i] = (1 - share) * interval.direction[i] + share * interval.end_direction[i];
  }
  const Rational offset = (1 - share) * *interval.offset + share * *interval.end_offset;
  const Rational norm = At(moving.motion, t).norm;
  std::vector<Rational> heights;
  for (const RationalVector& p : AllPlaced(moving, t)) {
    heights.push_back(norm * (Product(n, p) - offset));
  }
  return heights;
}

// Returns a rational number above the length of a vector: a tangent of the square root.
Rational LengthOver(const RationalVector& n) {
  const Rational squared = Product(n, n);
  const Rational guess(std::sqrt(static_cast<double>(squared)));
  return (guess + squared / guess) / 2;
}

// Returns the interval with its offsets moved by a radius times |n|, in the direction of `sign`.
SeparatedInterval Moved(SeparatedInterval interval, double radius, int sign) {
  if (radius == 0 || !interval.offset) return interval;
  const Rational length =
      std::max(LengthOver(interval.direction), LengthOver(interval.end_direction));
  *interval.offset += sign * Rational(radius) * length;
  *interval.end_offset += sign * Rational(radius) * length;
  return interval;
}

// Returns the Bernstein coefficients of the quartic with these values at 0, 1/4, 1/2, 3/4, and 1.
std::array<Rational, 5> Bernstein(const std::array<Rational, 5>& f) {
  const auto second = [](const Rational& f0, const Rational& f1, const Rational& f2,
                         const Rational& f3, const Rational& f4) {
    return (-13 * f0 + 48 * f1 - 36 * f2 + 16 * f3 - 3 * f4) / 12;
  };
  const Rational middle = (13 * (f[0] + f[4]) - 64 * (f[1] + f[3]) + 120 * f[2]) / 18;
  return {f[0], second(f[0], f[1], f[2], f[3], f[4]), middle, second(f[4], f[3], f[2], f[1], f[0]),
          f[4]};
}

// Returns true if all coefficients of all points have this strict sign.
bool HasSign(const MovingPoints& moving, const SeparatedInterval& interval, const Rational& from,
             int sign) {
  std::array<std::vector<Rational>, 5> values;
  for (int i = 0; i < 5; ++i) values[i] = HeightsAt(moving, interval, from, Rational(i, 4));
  for (size_t v = 0; v < moving.points.size(); ++v) {
    for (const Rational& c :
         Bernstein({values[0][v], values[1][v], values[2][v], values[3][v], values[4][v]})) {
      if (sign * c <= 0) return false;
    }
  }
  return true;
}

// Returns the least n.b minus the largest n.a.
Rational Gap(const MovingPoints& a, const MovingPoints& b, const SeparatedInterval& interval,
             const Rational& t) {
  const std::vector<Rational> of_a = ValuesAt(a, interval, t);
  const std::vector<Rational> of_b = ValuesAt(b, interval, t);
  return *std::min_element(of_b.begin(), of_b.end()) - *std::max_element(of_a.begin(), of_a.end());
}

}  // namespace

std::string FaultOf(const MovingPoints& a, const MovingPoints& b,
                    std::span<const SeparatedInterval> intervals, const Rational& until,
                    bool meets) {
  Rational from = 0;
  for (const SeparatedInterval& interval : intervals) {
    if (interval.until <= from) return "an interval is empty";
    if (interval.offset) {
      if (!HasSign(a, Moved(interval, a.radius, -1), from, -1)) return "A is beyond the plane";
      if (!HasSign(b, Moved(interval, b.radius, 1), from, 1)) return "B is before the plane";
    } else {
      if (Gap(a, b, interval, from) <= 0) return "no gap at the start of an interval";
      const bool is_last = &interval == &intervals.back();
      const Rational gap = Gap(a, b, interval, interval.until);
      if (gap < 0 || (gap == 0 && !(is_last && meets))) return "no gap at the end of an interval";
    }
    from = interval.until;
  }
  return from == until ? "" : "the intervals end at another time";
}

std::string FaultOfBriefContact(const MovingPoints& a, const MovingPoints& b, const Rational& from,
                                const Rational& until,
                                std::span<const std::pair<uint32_t, uint32_t>> pairs) {
  if (pairs.size() > 4) return "more than four pairs";
  std::vector<RationalVector> differences;
  for (const Rational& t : {from, until}) {
    const std::vector<RationalVector> of_a = AllPlaced(a, t);
    const std::vector<RationalVector> of_b = AllPlaced(b, t);
    for (const auto& [i, j] : pairs) {
      const RationalVector& p = of_a.at(i);
      const RationalVector& q = of_b.at(j);
      differences.push_back({p[0] - q[0], p[1] - q[1], p[2] - q[2]});
    }
  }
  return PositionAt(differences, {0, 0, 0}, 0) == OriginPosition::kOutside ? "the pairs do not meet"
                                                                           : "";
}

}  // namespace hulld::oracle
