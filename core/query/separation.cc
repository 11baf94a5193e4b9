#include "core/query/separation.h"

#include <absl/status/statusor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/rational.h"
#include "core/numeric/vector.h"
#include "core/query/axis_description.h"
#include "core/query/exact/exact_depth.h"
#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_depth.h"
#include "core/query/floating/float_distance.h"
#include "core/query/floating/float_search.h"
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

// Returns the absolute separation from its bounds: their midpoint, and half their width rounded up.
// The midpoint is positive because the upper bound is.
Separation MiddleOf(const SeparationBounds& bounds) {
  const double middle = bounds.low + (bounds.high - bounds.low) / 2;
  const double half = std::max(bounds.high - middle, middle - bounds.low);
  return {middle, std::nextafter(half, kInfinity)};
}

// Returns true if separation <= clearance, given the comparison of the absolute separation with
// |clearance|.
bool IsWithin(Relation relation, int comparison) {
  return relation == Relation::kSeparated ? comparison <= 0 : comparison >= 0;
}

class SeparationSearch {
 public:
  SeparationSearch(const FloatPair& pair, const Decision& decision, bool cold,
                   uint64_t max_depth_bytes, const std::function<bool()>& should_stop)
      : pair_(pair),
        decision_(decision),
        relation_(decision.relation),
        max_depth_bytes_(max_depth_bytes),
        should_stop_(should_stop),
        poll_(should_stop, kExpansionsPerPoll),
        size_(pair.a().query_hull().radius() + pair.b().query_hull().radius()) {
    if (relation_ == Relation::kTouching) {
      start_.assign(decision.pairs.begin(), decision.pairs.begin() + decision.pair_count);
    } else if (pair.usable()) {
      StartFrom(decision, cold);
    }
  }

  absl::Status AddValues(const SeparationRequest& request, SeparationAnswer& answer) {
    if (relation_ == Relation::kTouching) {
      if (request.separation) answer.separation = Separation{0, 0};
      return request.witness ? AddExactWitness(answer) : absl::OkStatus();
    }
    SeparationGoal goal;
    if (request.max_error) {
      goal.absolute_error = *request.max_error;
    } else {
      goal.relative_error = kDefaultRelativeMaxError;
      goal.size = size_;
    }
    Bound(goal, request.witness);
    if (poll_.stopped()) return Stopped();
    const Separation middle = MiddleOf(bounds_);
    const bool close =
        std::isfinite(bounds_.high) &&
        middle.bound <= goal.absolute_error + goal.relative_error * (goal.size + middle.value);
    if (request.separation) {
      if (close) {
        answer.separation = WithSign(middle);
      } else if (absl::Status s = AddExactSeparation(answer); !s.ok()) {
        return s;
      }
    }
    if (!request.witness) return absl::OkStatus();
    if (close && AddFloatWitness(answer)) return absl::OkStatus();
    return AddExactWitness(answer);
  }

  // Separated pairs only: floating point cannot tell two facets at about the same depth apart.
  absl::Status AddNormal(SeparationAnswer& answer) {
    if (relation_ == Relation::kTouching) {
      const std::optional<IntegerVector> n = ExactAxis(decision_);
      HULLD_CHECK(n.has_value());
      answer.normal = Normal{UnitDirection(*n), kUnitDirectionAngle};
      return absl::OkStatus();
    }
    if (!nearest_) {
      if (AddFloatNormal(answer)) return absl::OkStatus();
      SeparationGoal goal;
      if (relation_ == Relation::kSeparated) goal.relative_error = kNormalRelativeError;
      Bound(goal, false);
      if (poll_.stopped()) return Stopped();
      if (AddFloatNormal(answer)) return absl::OkStatus();
      if (absl::Status s = FindExactly(); !s.ok()) return s;
    }
    // The point of A - B that attains the separation.
    IntegerVector point = {0, 0, 0};
    for (size_t i = 0; i < nearest_->point.pairs.size(); ++i) {
      point = point + nearest_->point.weights[i] * exact_->Difference(nearest_->point.pairs[i]);
    }
    if (relation_ == Relation::kSeparated) point = -point;
    answer.normal = Normal{UnitDirection(point), kUnitDirectionAngle};
    return absl::OkStatus();
  }

  absl::Status AddClearance(double clearance, SeparationAnswer& answer) {
    if (relation_ == Relation::kTouching || (relation_ == Relation::kSeparated && clearance <= 0) ||
        (relation_ == Relation::kOverlapping && clearance >= 0) || std::isinf(clearance)) {
      // The separation is finite, so the sign of an infinite clearance decides.
      answer.within_clearance = relation_ == Relation::kSeparated ? clearance > 0 : clearance >= 0;
      return absl::OkStatus();
    }
    const double threshold = std::abs(clearance);
    const auto open = [&] { return !(bounds_.low > threshold || bounds_.high < threshold); };
    if (open()) {
      SeparationGoal goal;
      goal.threshold = threshold;
      Bound(goal, false);
      if (poll_.stopped()) return Stopped();
    }
    int comparison = bounds_.high < threshold ? -1 : 1;
    if (open()) {
      if (absl::Status s = FindExactly(); !s.ok()) return s;
      comparison = CompareSquareRoot(nearest_->numerator,
                                     exact_->norm() * exact_->norm() * nearest_->denominator,
                                     exact_->exponent(), threshold);
    }
    answer.within_clearance = IsWithin(relation_, comparison);
    return absl::OkStatus();
  }

 private:
  static absl::Status Stopped() { return absl::CancelledError("stopped in a query"); }

  // Chooses the start of the floating-point search: the axis that it found, or four pairs with
  // differences that surround the origin. The choice does not depend on the suggestion of a cache.
  void StartFrom(const Decision& decision, bool cold) {
    toward_ = -pair_.CenterDifference();
    if (cold || decision.rung == Rung::kBounds) {
      if (const Vector* n = std::get_if<Vector>(&decision.axis)) toward_ = *n;
      start_.assign(decision.pairs.begin(), decision.pairs.begin() + decision.pair_count);
      return;
    }
    const FloatSearchResult found = SearchInFloatingPoint(pair_, 0, -pair_.CenterDifference());
    if (found.verdict == FloatVerdict::kSeparated) toward_ = found.axis;
    if (found.verdict != FloatVerdict::kOverlapping) return;
    start_.assign(found.pairs.begin(), found.pairs.begin() + found.pair_count);
  }

  // Finds bounds in floating point, as close to the goal as it allows. Exact arithmetic starts from
  // the vertices that this visits.
  void Bound(const SeparationGoal& goal, bool want_point) {
    if (!pair_.usable()) return;
    if (relation_ == Relation::kSeparated) {
      bounds_ = BoundDistance(pair_, toward_, goal);
      seed_.assign(bounds_.point.pairs.begin(), bounds_.point.pairs.begin() + bounds_.point.count);
    } else {
      seed_.clear();
      bounds_ = BoundDepth(pair_, start_, goal, want_point, poll_, seed_);
    }
  }

  absl::Status FindExactly() {
    if (nearest_) return absl::OkStatus();
    exact_.emplace(pair_, should_stop_);
    absl::StatusOr<ExactNearest> nearest =
        relation_ == Relation::kOverlapping
            ? FindDepthExactly(*exact_, seed_, max_depth_bytes_, should_stop_)
        : relation_ == Relation::kSeparated ? FindNearestExactly(*exact_, seed_, should_stop_)
                                            : FindNearestExactly(*exact_, start_, should_stop_);
    if (!nearest.ok()) return nearest.status();
    nearest_ = *std::move(nearest);
    return absl::OkStatus();
  }

  Rounded ExactLength() const {
    return RoundSquareRoot(nearest_->numerator,
                           exact_->norm() * exact_->norm() * nearest_->denominator,
                           exact_->exponent());
  }

  Separation WithSign(const Separation& length) const {
    return {relation_ == Relation::kOverlapping ? -length.value : length.value, length.bound};
  }

  absl::Status AddExactSeparation(SeparationAnswer& answer) {
    if (absl::Status s = FindExactly(); !s.ok()) return s;
    const Rounded length = ExactLength();
    answer.separation = WithSign({length.value, length.bound});
    return absl::OkStatus();
  }

  // Returns false if the point is not known accurately enough.
  bool AddFloatWitness(SeparationAnswer& answer) const {
    const FloatCombination& point = bounds_.point;
    if (point.count == 0) return false;
    const double rounding = kCombinationErrorFactor * pair_.size();
    const double width =
        std::max(bounds_.point_length - bounds_.low, bounds_.high - bounds_.point_length);
    if (width > 4 * (MiddleOf(bounds_).bound + rounding)) return false;
    Vector p_A = Vector::Zero();
    Vector p_B = Vector::Zero();
    for (uint32_t i = 0; i < point.count; ++i) {
      p_A += Vector(point.weights[i] * pair_.PositionA(point.pairs[i].a));
      p_B += Vector(point.weights[i] * pair_.PositionB(point.pairs[i].b));
    }
    const Vector& t = pair_.a().X_WH().t;
    Witness witness{p_A + t, p_B + t, 0};
    const double largest =
        std::max(witness.p_WA.cwiseAbs().maxCoeff(), witness.p_WB.cwiseAbs().maxCoeff());
    witness.error = width + 2 * rounding + 4 * kUnitRoundoff * largest;
    answer.witness = witness;
    return true;
  }

  // Adds the normal of a separated pair: the direction from a point v of A - B, as computed, to the
  // origin. Returns false if its bound would exceed kMaxNormalAngle. Some point p of A - B is
  // within kCombinationErrorFactor of v and no longer than the upper bound, so the angle between p
  // and the nearest point follows from both bounds, and that between v and p from their distance.
  bool AddFloatNormal(SeparationAnswer& answer) const {
    if (relation_ != Relation::kSeparated || bounds_.point.count == 0 || !(bounds_.low > 0)) {
      return false;
    }
    const double width = (bounds_.high - bounds_.low) / bounds_.high;
    const double rounding = kCombinationErrorFactor * pair_.size() / bounds_.low;
    const double angle =
        kNearestAngleRoundUp * std::sqrt(2 * width) + 2 * rounding + kUnitDirectionAngle;
    if (!(angle <= kMaxNormalAngle)) return false;
    Vector to_origin = Vector::Zero();
    for (uint32_t i = 0; i < bounds_.point.count; ++i) {
      to_origin -= Vector(bounds_.point.weights[i] * pair_.Difference(bounds_.point.pairs[i]));
    }
    answer.normal = Normal{Vector(to_origin / UnitOf(pair_.size())).normalized(), angle};
    return true;
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
    answer.witness = witness;
    return absl::OkStatus();
  }

  const FloatPair& pair_;
  const Decision& decision_;
  const Relation relation_;
  const uint64_t max_depth_bytes_;
  const std::function<bool()>& should_stop_;
  StopPoll poll_;
  const double size_;
  Vector toward_ = Vector::Zero();
  std::vector<VertexPair> start_;
  std::vector<VertexPair> seed_;
  SeparationBounds bounds_;
  std::optional<ExactPair> exact_;
  std::optional<ExactNearest> nearest_;
};

}  // namespace

absl::Status FindSeparation(const FloatPair& pair, const Decision& decision, bool cold,
                            const SeparationRequest& request,
                            const std::function<bool()>& should_stop, SeparationAnswer& answer) {
  HULLD_CHECK(decision.relation != Relation::kWithinTolerance);
  SeparationSearch search(pair, decision, cold, request.max_depth_bytes, should_stop);
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
