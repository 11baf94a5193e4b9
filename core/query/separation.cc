#include "core/query/separation.h"

#include <absl/status/statusor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/rational.h"
#include "core/numeric/vector.h"
#include "core/query/axis_description.h"
#include "core/query/exact/exact_depth.h"
#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_depth.h"
#include "core/query/floating/float_distance.h"
#include "core/query/floating/float_search.h"
#include "core/query/floating/nearest_part.h"
#include "core/query/terms/length_sum.h"
#include "core/query/terms/query_options.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {
namespace {

// Expansions of a polytope between two polls. An expansion that creates many facets counts several
// times.
constexpr uint64_t kExpansionsPerPoll = 32;

// The goal of the distance for a normal within kMaxNormalAngle: half the width of its bounds,
// relative to it. The angle is then at most kMaxNormalAngle / sqrt(2), and the rest is for
// rounding.
constexpr double kNormalRelativeError = kMaxNormalAngle * kMaxNormalAngle / 8;

// The least singular value of a matrix of two differences of computed Minkowski vertices, from
// below by the area that they span over the Frobenius norm: entries err by 2 * 128 u S + u * 8 S,
// so the matrix by at most sqrt(6) * 264 u S = 647 u S, and a singular value by no more (Weyl
// 1912); rounding of the area, the norm, and their ratio moves it by at most 20 u * 8 S. The
// Frobenius norm of two differences of computed vertices of A errs by no more. Times S. Proven.
constexpr double kSpanErrorFactor = 1024 * kUnitRoundoff;

// Lower bounds on the distance in a plane of the origin from an edge of two computed Minkowski
// vertices p and q, n . (p x q) / |q - p| for a unit vector n across the plane (length within 8 u
// of 1): each vertex errs by sqrt(3) * 128 u S = 222 u S and is at most 7 S, so the product by 2 *
// 7 * 223 u S^2, and by 11 u * 49 S^2 for rounding and the length of n: below 4000 u S^2. The
// length of the edge errs by 2 * 222 u S and rounding of at most 14 S by 6 u: below 600 u S.
// Proven.
constexpr double kEdgeMomentErrorFactor = 4096 * kUnitRoundoff;
constexpr double kEdgeLengthErrorFactor = 1024 * kUnitRoundoff;

// Returns the absolute separation from its bounds: their midpoint, and half their width rounded up.
// The midpoint is positive because the upper bound is.
Separation MiddleOf(const SeparationBounds& bounds) {
  const double middle = bounds.low + (bounds.high - bounds.low) / 2;
  const double half = std::max(bounds.high - middle, middle - bounds.low);
  return {middle, std::nextafter(half, kInfinity)};
}

// The sign of a separation with this relation.
int SignOf(Relation relation) {
  return relation == Relation::kSeparated ? 1 : relation == Relation::kTouching ? 0 : -1;
}

// The radius of a rounded hull, within u of itself.
double RadiusOf(const PlacedHull& placed) { return placed.radii()[0] + placed.radii()[1]; }

// Finds the separation of the cores. The separation of the rounded hulls is less by the sum of
// their radii and is attained in the same direction, because that sum increases the reach of A - B
// along each unit vector equally.
class SeparationSearch {
 public:
  SeparationSearch(const FloatPair& pair, const Decision& decision, Relation relation, bool cold,
                   const SeparationRequest& request, const std::function<bool()>& should_stop)
      : pair_(pair),
        decision_(decision),
        core_(decision.relation),
        relation_(relation),
        radii_(pair.RadiiPlus(0)),
        max_depth_bytes_(request.max_depth_bytes),
        should_stop_(should_stop),
        poll_(should_stop, kExpansionsPerPoll),
        size_(pair.a().query_hull().radius() + pair.b().query_hull().radius() + radii_.value()) {
    if (core_ == Relation::kTouching) {
      SetStart(decision.pairs, decision.pair_count);
    } else if (pair.usable()) {
      StartFrom(decision, cold, SearchErrorFor(request));
    }
  }

  absl::Status AddValues(const SeparationRequest& request, SeparationAnswer& answer) {
    if (relation_ == Relation::kTouching) {
      if (request.separation) answer.separation = Separation{0, 0};
      const double max_error = request.max_error.value_or(kDefaultRelativeMaxError * size_);
      if (!request.witness || AddFloatContact(max_error, answer)) return absl::OkStatus();
      return AddExactWitness(answer);
    }
    SeparationGoal goal;
    if (request.max_error) {
      goal.absolute_error = *request.max_error;
    } else {
      goal.relative_error = kDefaultRelativeMaxError;
      goal.size = size_;
    }
    std::optional<Separation> close;
    if (core_ != Relation::kTouching) close = BoundClosely(goal, request.witness);
    if (poll_.stopped()) return Stopped();
    if (request.separation) {
      if (close) {
        answer.separation = *close;
      } else if (absl::Status s = AddExactSeparation(answer); !s.ok()) {
        return s;
      }
    }
    if (!request.witness) return absl::OkStatus();
    if (close && AddFloatWitness(close->bound, answer)) return absl::OkStatus();
    return AddExactWitness(answer);
  }

  absl::Status AddNormal(SeparationAnswer& answer) {
    if (!nearest_ && core_ != Relation::kTouching) {
      if (AddFloatNormal(answer)) return absl::OkStatus();
      SeparationGoal goal;
      if (core_ == Relation::kSeparated) goal.relative_error = kNormalRelativeError;
      Bound(goal, true);
      if (poll_.stopped()) return Stopped();
      if (AddFloatNormal(answer)) return absl::OkStatus();
      if (absl::Status s = FindExactly(); !s.ok()) return s;
    }
    answer.normal = Normal{UnitDirection(NormalDirection()), kUnitDirectionAngle};
    return absl::OkStatus();
  }

  // Compares the separation of the cores with the sum of the clearance and the radii.
  absl::Status AddClearance(double clearance, SeparationAnswer& answer) {
    if (const std::optional<bool> known = KnownWithin(clearance)) {
      answer.within_clearance = *known;
      return absl::OkStatus();
    }
    const LengthSum limit = pair_.RadiiPlus(clearance);
    const int sign = limit.Sign();
    int comparison = SignOf(core_) - sign;
    if (comparison == 0 && sign != 0) {
      if (absl::Status s = CompareAbsolute(sign, limit, comparison); !s.ok()) return s;
      comparison *= sign;
    }
    answer.within_clearance = comparison <= 0;
    return absl::OkStatus();
  }

 private:
  static absl::Status Stopped() { return absl::CancelledError("the query was cancelled"); }

  // Returns true if separation <= clearance, if the relation or an infinite clearance shows it.
  std::optional<bool> KnownWithin(double clearance) const {
    // The separation is finite.
    if (std::isinf(clearance)) return clearance > 0;
    if (relation_ == Relation::kSeparated) {
      return clearance <= 0 ? std::optional(false) : std::nullopt;
    }
    if (clearance >= 0) return true;
    return relation_ == Relation::kTouching ? std::optional(false) : std::nullopt;
  }

  // Sets `comparison` to the sign of the absolute separation of the cores minus |sum|. Requires:
  // both not 0. `sign`: that of the sum.
  absl::Status CompareAbsolute(int sign, const LengthSum& sum, int& comparison) {
    const double low = sign > 0 ? sum.low() : -sum.high();
    const double high = sign > 0 ? sum.high() : -sum.low();
    const auto open = [&] { return !(bounds_.low > high || bounds_.high < low); };
    if (open()) {
      SeparationGoal goal;
      goal.threshold = std::abs(sum.value());
      Bound(goal, false);
      if (poll_.stopped()) return Stopped();
    }
    comparison = bounds_.high < low ? -1 : 1;
    if (!open()) return absl::OkStatus();
    if (absl::Status s = FindExactly(); !s.ok()) return s;
    ScaledInteger threshold = sum.Exact();
    threshold.mantissa = abs(threshold.mantissa);
    comparison =
        CompareSquareRoot(nearest_->numerator, ExactDenominator(), exact_->exponent(), threshold);
    return absl::OkStatus();
  }

  // Chooses the start of the floating-point search: the axis and pairs that the search of the
  // relation ended with, or four pairs with differences that surround the origin. The choice does
  // not depend on the suggestion of a cache.
  void StartFrom(const Decision& decision, bool cold, double max_error) {
    toward_ = -pair_.CenterDifference();
    if (cold || decision.rung == Rung::kBounds) {
      if (const Vector* n = std::get_if<Vector>(&decision.axis)) toward_ = *n;
      reach_ = decision.reach;
      SetStart(decision.pairs, decision.pair_count);
      return;
    }
    const FloatSearchResult found =
        SearchInFloatingPoint(pair_, 0, -pair_.CenterDifference(), max_error);
    if (found.verdict == FloatVerdict::kUndecided) return;
    if (found.verdict == FloatVerdict::kSeparated) toward_ = found.axis;
    reach_ = found.reach;
    SetStart(found.pairs, found.pair_count);
  }

  void SetStart(const std::array<VertexPair, 4>& pairs, uint32_t count) {
    start_pairs_ = pairs;
    start_count_ = count;
  }
  std::span<const VertexPair> start() const { return std::span(start_pairs_).first(start_count_); }

  // Finds bounds as close to the goal as floating point allows. Exact arithmetic starts from the
  // vertices visited here.
  void Bound(const SeparationGoal& goal, bool want_point) {
    if (!pair_.usable()) return;
    if (core_ == Relation::kSeparated) {
      bounds_ = BoundDistance(pair_, toward_, start(), goal, reach_);
    } else {
      seed_.clear();
      bounds_ = BoundDepth(pair_, start(), goal, want_point, poll_, seed_);
    }
  }

  absl::Status FindExactly() {
    if (nearest_) return absl::OkStatus();
    exact_.emplace(pair_, should_stop_);
    absl::StatusOr<ExactNearest> nearest =
        core_ == Relation::kOverlapping
            ? FindDepthExactly(*exact_, seed_, max_depth_bytes_, should_stop_)
        : core_ == Relation::kSeparated
            ? FindNearestExactly(*exact_, std::span(bounds_.point.pairs).first(bounds_.point.count),
                                 should_stop_)
            : FindNearestExactly(*exact_, start(), should_stop_);
    if (!nearest.ok()) return nearest.status();
    nearest_ = *std::move(nearest);
    return absl::OkStatus();
  }

  // The squared absolute separation of the cores is the numerator of nearest_ over this.
  Integer ExactDenominator() const {
    return exact_->norm() * exact_->norm() * nearest_->denominator;
  }

  // Returns a positive multiple of the exact normal. Requires: FindExactly, unless the cores touch.
  IntegerVector NormalDirection() {
    if (core_ == Relation::kTouching) {
      const std::optional<IntegerVector> n = ExactAxis(decision_.axis);
      HULLD_CHECK(n.has_value());
      return *n;
    }
    const IntegerVector point = PointOf(*exact_, nearest_->point);
    return core_ == Relation::kSeparated ? -point : point;
  }

  // Improves the bounds. Returns the separation if they meet the goal.
  std::optional<Separation> BoundClosely(const SeparationGoal& goal, bool want_point) {
    SeparationGoal of_cores = goal;
    if (!radii_.is_zero()) {
      // The value may be less than the separation of the cores, by no more than the size.
      of_cores.absolute_error /= 2;
      of_cores.relative_error /= 4;
    }
    Bound(of_cores, want_point);
    if (poll_.stopped() || !std::isfinite(bounds_.high)) return std::nullopt;
    const Separation found = FromBounds();
    const double allowed =
        goal.absolute_error + goal.relative_error * (goal.size + std::abs(found.value));
    const bool met =
        std::isfinite(found.bound) && SignOf(relation_) * found.value > 0 && found.bound <= allowed;
    return met ? std::optional(found) : std::nullopt;
  }

  // Returns the separation, from the bounds on the separation of the cores. Requires: finite
  // bounds.
  Separation FromBounds() const {
    const Separation cores = WithSign(MiddleOf(bounds_));
    if (radii_.is_zero()) return cores;
    const double value = cores.value - radii_.value();
    const double rounding = radii_.error() + 4 * kUnitRoundoff * std::abs(value);
    return {value, std::nextafter((cores.bound + rounding) * (1 + 4 * kUnitRoundoff), kInfinity)};
  }

  Separation WithSign(const Separation& length) const {
    return {core_ == Relation::kOverlapping ? -length.value : length.value, length.bound};
  }

  absl::Status AddExactSeparation(SeparationAnswer& answer) {
    if (core_ != Relation::kTouching) {
      if (absl::Status s = FindExactly(); !s.ok()) return s;
    }
    const Rounded length = ExactLength();
    answer.separation = Separation{length.value, length.bound};
    return absl::OkStatus();
  }

  Rounded ExactLength() const {
    if (core_ == Relation::kTouching) return RoundRootMinus(0, 0, 1, 0, radii_.Exact());
    if (!radii_.is_zero()) {
      return RoundRootMinus(SignOf(core_), nearest_->numerator, ExactDenominator(),
                            exact_->exponent(), radii_.Exact());
    }
    const Rounded length =
        RoundSquareRoot(nearest_->numerator, ExactDenominator(), exact_->exponent());
    return {SignOf(core_) * length.value, length.bound};
  }

  // Returns false if the point is not known accurately enough. `bound`: that of the separation.
  bool AddFloatWitness(double bound, SeparationAnswer& answer) const {
    const FloatCombination& point = bounds_.point;
    // Radii multiply the error of the direction, which only exact arithmetic keeps small.
    if (point.count == 0 || !radii_.is_zero()) return false;
    const double rounding = kCombinationErrorFactor * pair_.size();
    const double width =
        std::max(bounds_.point_length - bounds_.low, bounds_.high - bounds_.point_length);
    if (width > 4 * (bound + rounding)) return false;
    PlainVector p_A;
    PlainVector p_B;
    for (uint32_t i = 0; i < point.count; ++i) {
      p_A = p_A + point.weights[i] * pair_.PositionA(point.pairs[i].a);
      p_B = p_B + point.weights[i] * pair_.PositionB(point.pairs[i].b);
    }
    const PlainVector t = pair_.a().X_WH().t;
    const PlainVector p_WA = p_A + t;
    const PlainVector p_WB = p_B + t;
    const double largest = std::max(LargestComponent(p_WA), LargestComponent(p_WB));
    answer.witness = {p_WA, p_WB, width + 2 * rounding + 4 * kUnitRoundoff * largest};
    return true;
  }

  // Adds a common point of touching cores. Returns false if its error may exceed `max_error`. The
  // exact weights that combine the differences w_i of the pairs to 0 differ from the computed
  // weights by d with |sum d_i (w_i - w_0)| = |v|, v being the computed combination. So |d| is at
  // most |v| over the least singular value of the w_i - w_0, and the computed point of A misses the
  // exact one, which is common, by at most |d| times the norm of the matrix of the a_i - a_0.
  bool AddFloatContact(double max_error, SeparationAnswer& answer) const {
    if (!radii_.is_zero() || start_count_ != 3 || !pair_.usable()) return false;
    std::array<VertexPair, 3> pairs = {start_pairs_[0], start_pairs_[1], start_pairs_[2]};
    const auto last =
        static_cast<uint32_t>(std::unique(pairs.begin(), pairs.end()) - pairs.begin()) - 1;
    // In units near the size.
    const double unit = UnitOf(pair_.size());
    const double size = pair_.size() / unit;
    std::array<Vector, 3> a;
    std::array<Vector, 3> w;
    for (uint32_t i = 0; i <= last; ++i) {
      a[i] = 1 / unit * pair_.PositionA(pairs[i].a);
      w[i] = 1 / unit * pair_.Difference(pairs[i]);
    }
    double error = kCombinationErrorFactor * size;
    Vector contact = a[0];
    if (last > 0) {
      const NearestPart part = NearestOnTriangle(w[0], w[1], w[last]);
      contact = Vector::Zero();
      for (uint32_t i = 0; i < part.count; ++i) {
        contact += part.weights[i] * a[std::min<uint32_t>(part.corners[i], last)];
      }
      const Vector e = w[1] - w[0];
      const Vector f = w[last] - w[0];
      const double least =
          last == 1 ? e.norm() : e.cross(f).norm() / std::sqrt(e.squaredNorm() + f.squaredNorm());
      const double spread = std::sqrt((a[1] - a[0]).squaredNorm() + (a[last] - a[0]).squaredNorm());
      const double slack = kSpanErrorFactor * size;
      if (!(least > 2 * slack)) return false;
      error += (Norm(part.point) + error) * (spread + slack) / (least - slack);
    }
    const Vector& t = pair_.a().X_WH().t;
    const Vector p = unit * contact + t;
    const double largest = std::max(p.cwiseAbs().maxCoeff(), t.cwiseAbs().maxCoeff());
    error = unit * error * (1 + 32 * kUnitRoundoff) + 4 * kUnitRoundoff * largest;
    if (!std::isfinite(error) || error > max_error) return false;
    answer.witness = Witness{p, p, error};
    return true;
  }

  // Adds the normal. Returns false if its bound would exceed kMaxNormalAngle. Outside facets, only
  // the normal of a separated pair is known: the direction from a point v of A - B, as computed, to
  // the origin. Some point p of A - B is within kCombinationErrorFactor of v and no longer than the
  // upper bound, so the angle between p and the nearest point follows from both bounds, and that
  // between v and p from their distance.
  bool AddFloatNormal(SeparationAnswer& answer) const {
    if (bounds_.point.count == 0 || !(bounds_.low > 0)) return false;
    if (const double angle = AngleAtFacet(); angle <= kMaxNormalAngle) {
      // 0 stays +0.
      answer.normal = Normal{(Vector::Zero() + bounds_.direction).normalized(), angle};
      return true;
    }
    if (core_ != Relation::kSeparated) return false;
    const double width = (bounds_.high - bounds_.low) / bounds_.high;
    const double rounding = kCombinationErrorFactor * pair_.size() / bounds_.low;
    const double angle =
        kNearestAngleRoundUp * std::sqrt(2 * width) + 2 * rounding + kUnitDirectionAngle;
    if (!(angle <= kMaxNormalAngle)) return false;
    answer.normal = Normal{TowardOrigin(pair_, bounds_).normalized(), angle};
    return true;
  }

  // Returns an upper bound on the angle between `bounds_.direction` and the normal if the point
  // that attains the separation is inside a facet of known corners p_i, otherwise infinity. Let m
  // be the distance of the axis through the origin along the direction from the edges, seen along
  // the axis: points of the facet project onto m e for all e across.
  //
  // Separated: n is minus the direction, the nearest point lies along cos(t) n + sin(t) e, and no
  // point of A - B is nearer along it than the lower bound l. With n.p_i <= h, the point of the
  // facet at -m e gives h cos(t) - m sin(t) >= l, so sin(t) <= (h - l) / m.
  //
  // Overlapping: n is the direction, and the depth is at most h. A - B reaches no farther than h
  // along the nearest direction u = cos(t) n + sin(t) e, so the ray along u leaves the polytope
  // within h, through a facet with n.p >= l > 0: cos(t) >= l / h. The point of the facet at m e
  // gives l cos(t) + m sin(t) <= h. So sin(t) <= (h - l^2 / h) / m <= 2 (h - l) / m.
  //
  // Computed corners are within 222 u S of points of A - B, and values along n err by 84 u S: l and
  // h move by 306 u S in total, and kReachErrorFactor covers that.
  double AngleAtFacet() const {
    if (bounds_.point.count != 3 || IsZero(bounds_.direction)) return kInfinity;
    // In units near the size.
    const double unit = UnitOf(pair_.size());
    const double size = pair_.size() / unit;
    const bool apart = core_ == Relation::kSeparated;
    const PlainVector n = apart ? Vector(-bounds_.direction) : bounds_.direction;
    std::array<PlainVector, 3> p;
    for (int i = 0; i < 3; ++i) p[i] = 1 / unit * pair_.Difference(bounds_.point.pairs[i]);
    const double turn = Dot(n, Cross(p[1] - p[0], p[2] - p[0])) > 0 ? 1 : -1;
    double reach = 0;
    double margin = kInfinity;
    for (int i = 0; i < 3; ++i) {
      const PlainVector& q = p[(i + 1) % 3];
      reach = std::max(reach, Dot(n, p[i]));
      const double moment = turn * Dot(n, Cross(p[i], q)) - kEdgeMomentErrorFactor * size * size;
      margin = std::min(margin, moment / (Norm(q - p[i]) + kEdgeLengthErrorFactor * size));
    }
    const double gap =
        apart ? reach - bounds_.low / unit : 2 * (bounds_.high - bounds_.facet_low) / unit;
    const bool ahead = apart || bounds_.facet_low > kReachErrorFactor * pair_.size();
    if (!(margin > 0) || !ahead) return kInfinity;
    // A sine below 2^-19 is exceeded by its angle by less than 2^-39 of it.
    return (gap + 2 * kReachErrorFactor * size) / margin * kNearestAngleRoundUp +
           kUnitDirectionAngle;
  }

  // Returns the weighted sum of vertices of A, or of B, in the world frame.
  Vector ExactPoint(bool of_a, double& error) {
    const ExactCombination& point = nearest_->point;
    IntegerVector sum = point.weight_sum * exact_->TranslationA();
    for (size_t i = 0; i < point.pairs.size(); ++i) {
      const IntegerVector& vertex =
          of_a ? exact_->VertexA(point.pairs[i].a) : exact_->VertexB(point.pairs[i].b);
      sum = sum + point.weights[i] * vertex;
    }
    const Integer denominator = point.weight_sum * exact_->norm();
    Vector result;
    for (int i = 0; i < 3; ++i) {
      const Rounded rounded = RoundRatio(sum[i], denominator, exact_->exponent());
      result[i] = rounded.value;
      error += rounded.bound;
    }
    return result;
  }

  absl::Status AddExactWitness(SeparationAnswer& answer) {
    if (absl::Status s = FindExactly(); !s.ok()) return s;
    Witness witness;
    witness.p_WA = ExactPoint(true, witness.error);
    witness.p_WB = ExactPoint(false, witness.error);
    if (!radii_.is_zero()) MoveToSurfaces(witness);
    answer.witness = witness;
    return absl::OkStatus();
  }

  // Moves points of the cores along the normal to the surfaces of the rounded hulls. The direction
  // errs by kUnitDirectionAngle and u of its length, a radius by u of itself, products and sums by
  // u per component. Proven.
  void MoveToSurfaces(Witness& witness) {
    const Vector n = UnitDirection(NormalDirection());
    const double radius_a = RadiusOf(pair_.a());
    const double radius_b = RadiusOf(pair_.b());
    witness.p_WA += radius_a * n;
    witness.p_WB -= radius_b * n;
    if (relation_ == Relation::kTouching) witness.p_WB = witness.p_WA;
    const double largest =
        std::max(witness.p_WA.cwiseAbs().maxCoeff(), witness.p_WB.cwiseAbs().maxCoeff());
    witness.error += 16 * kUnitRoundoff * std::max(radius_a, radius_b) +
                     4 * kUnitRoundoff * largest + 4 * kMinDouble;
    if (std::isfinite(largest)) return;
    for (Vector* const p : {&witness.p_WA, &witness.p_WB}) {
      *p = p->cwiseMax(-kLargestDouble).cwiseMin(kLargestDouble);
    }
    witness.error = kInfinity;
  }

  const FloatPair& pair_;
  const Decision& decision_;
  // The relations of the cores and of the rounded hulls, and the sum of the radii.
  const Relation core_;
  const Relation relation_;
  const LengthSum radii_;
  const uint64_t max_depth_bytes_;
  const std::function<bool()>& should_stop_;
  StopPoll poll_;
  const double size_;
  Vector toward_ = Vector::Zero();
  // FloatSearchResult::reach along it, if known.
  double reach_ = INFINITY;
  uint32_t start_count_ = 0;
  std::array<VertexPair, 4> start_pairs_;
  // Overlapping: the pairs of all vertices that the floating-point search visited.
  std::vector<VertexPair> seed_;
  SeparationBounds bounds_;
  std::optional<ExactPair> exact_;
  std::optional<ExactNearest> nearest_;
};

}  // namespace

absl::Status FindSeparation(const FloatPair& pair, const Decision& decision, Relation relation,
                            bool cold, const SeparationRequest& request,
                            const std::function<bool()>& should_stop, SeparationAnswer& answer) {
  HULLD_CHECK(decision.relation != Relation::kWithinTolerance &&
              relation != Relation::kWithinTolerance);
  SeparationSearch search(pair, decision, relation, cold, request, should_stop);
  if (request.separation || request.witness) {
    if (absl::Status s = search.AddValues(request, answer); !s.ok()) return s;
  }
  if (request.normal) {
    if (absl::Status s = search.AddNormal(answer); !s.ok()) return s;
  }
  if (!request.clearance) return absl::OkStatus();
  return search.AddClearance(*request.clearance, answer);
}

}  // namespace hulld
