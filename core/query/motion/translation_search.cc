#include "core/query/motion/translation_search.h"

#include <absl/status/status.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/rational.h"
#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_search.h"
#include "core/query/floating/float_pair.h"
#include "core/query/ladder.h"
#include "core/query/motion/nearest_direction.h"
#include "core/query/motion/sweep.h"
#include "core/query/placed/placed_hull.h"
#include "core/query/terms/pose.h"
#include "core/query/terms/pose_product.h"

namespace hulld {
namespace {

// Floating point ends when the gap is this small relative to the pair, or after this many steps;
// exact queries do the rest. Choices.
constexpr double kLeastRelativeGap = 0x1p-46;
constexpr int kMostFloatSteps = 24;
// Share of the gap that a step in floating point leaves open, more than rounding takes. A choice.
constexpr double kOpenShare = 0x1p-10;
// Factor between the strides of successive exact queries. A choice.
constexpr int64_t kStrideFactor = 16;

// Positions among the non-negative doubles, in ascending order.
int64_t OrdinalOf(double x) { return std::bit_cast<int64_t>(x); }
double DoubleAt(int64_t ordinal) { return std::bit_cast<double>(ordinal); }

// A rational number in [0, 1], rounded down.
struct FloorTime {
  double value;
  bool exact;
};

// Requires: numerator >= 0, denominator > 0. Numbers above 1 become 1.
FloorTime RoundDown(const Integer& numerator, const Integer& denominator) {
  HULLD_CHECK(Sign(numerator) >= 0 && Sign(denominator) > 0);
  if (numerator >= denominator) return {1, numerator == denominator};
  if (numerator.is_zero()) return {0, true};
  // Returns the sign of x - numerator / denominator.
  const auto compare = [&](double x) {
    if (x == 0) return -1;
    const int lowest = LowestBitExponent(x);
    const Integer scaled = ToInteger(x, lowest) * denominator;
    return lowest < 0 ? scaled.compare(Integer(numerator << -lowest))
                      : Integer(scaled << lowest).compare(numerator);
  };
  double value = RoundToNearest(numerator, denominator, 0).value;
  int order = compare(value);
  if (order > 0) {
    value = std::nextafter(value, 0.0);
    order = compare(value);
  }
  return {value, order == 0};
}

IntegerVector ToExact(const std::variant<Vector, IntegerVector>& direction) {
  if (const IntegerVector* n = std::get_if<IntegerVector>(&direction)) return *n;
  const Vector& n = std::get<Vector>(direction);
  return ToInteger(n, LowestBitExponent(n, kAboveAllExponents));
}

Vector DisplacementOf(const Motion& motion) { return motion.end.t - motion.start.t; }

// Returns the direction of the point of a path that is nearest to the origin, of unit length up to
// rounding. Zero if it is the origin.
Vector NearestOnPath(const Vector& start, const Vector& displacement) {
  const double squared = displacement.squaredNorm();
  const double time = squared > 0 ? std::clamp(-start.dot(displacement) / squared, 0.0, 1.0) : 0;
  return (start + time * displacement).normalized();
}

}  // namespace

// The unit of the pair at time 1/2 divides half of each translation.
TranslationSearch::Middle::Middle(const MovingHull& a, const MovingHull& b,
                                  const std::function<bool()>& should_stop)
    : at(a, b, 0.5), pair(at.pair(), should_stop) {
  const auto half_of = [&](const Motion& motion) {
    const IntegerVector step =
        ToInteger(motion.end.t, pair.exponent()) - ToInteger(motion.start.t, pair.exponent());
    return IntegerVector{step.x / 2, step.y / 2, step.z / 2};
  };
  half = pair.norm() * (half_of(b.X_WB) - half_of(a.X_WB));
}

TranslationSearch::Middle& TranslationSearch::middle() {
  if (!middle_) middle_.emplace(a_, b_, options_.should_stop);
  return *middle_;
}

absl::StatusOr<FirstContact> TranslationSearch::Run() {
  if (absl::Status s = AdvanceInFloatingPoint(); !s.ok()) return s;
  if (absl::Status s = TryFacet(); !s.ok()) return s;
  if (absl::Status s = Narrow(); !s.ok()) return s;
  return Conclude();
}

absl::Status TranslationSearch::AdvanceInFloatingPoint() {
  const PairAt at_start(a_, b_, 0);
  const FloatPair& start = at_start.pair();
  const Vector of_a = DisplacementOf(a_.X_WB);
  const Vector of_b = DisplacementOf(b_.X_WB);
  const Vector displacement = of_b - of_a;
  const double size = start.size() + of_a.cwiseAbs().maxCoeff() + of_b.cwiseAbs().maxCoeff();
  if (!start.usable() || !IsFilterSize(size)) return absl::OkStatus();
  // Lower bounds of the gap along a direction of about unit length at time 0, and at a later time.
  const auto gap_at_start = [&](const Vector& n) {
    return -start.Farthest(n).value - start.SupportError(n);
  };
  const auto gap_at = [&](double gap_before, const Vector& n, double time) {
    return gap_before + time * n.dot(displacement) - kTranslatedGapErrorFactor * size;
  };
  Vector toward = -Vector(start.CenterDifference());
  if (toward.isZero(0)) return absl::OkStatus();
  if (const Vector n = NearestOnPath(toward, displacement); !n.isZero(0)) {
    // Balls around the hulls, then the hulls.
    const double reach = a_.hull.radius() + b_.hull.radius();
    const auto separates = [&](double gap) {
      return gap_at(gap, n, 0) > 0 && gap_at(gap, n, 1) > 0;
    };
    if (separates(n.dot(toward) - reach) || separates(gap_at_start(n))) {
      TakeSeparatedFrom(0, n);
      return absl::OkStatus();
    }
  }
  std::optional<PoseProduct> product;
  std::optional<PlacedHull> moved;
  std::optional<FloatPair> later;
  for (int step = 0; step < kMostFloatSteps; ++step) {
    if (poll_.Step()) return MotionStopped();
    if (step > 0) {
      // Rounded: every claim is about `start`.
      const Pose& before = b_.X_WB.start;
      const Pose X_WB{before.q, before.t + lower_ * displacement};
      if (IsIdentity(b_.X_BH)) {
        moved.emplace(b_.hull, X_WB);
      } else {
        product.emplace(X_WB, b_.X_BH);
        moved.emplace(b_.hull, *product);
      }
      later.emplace(start.a(), *moved);
      if (!later->usable()) return absl::OkStatus();
    }
    const absl::StatusOr<Vector> found =
        NearestDirection(step > 0 ? *later : start, toward, options_.should_stop, &nearest_);
    if (!found.ok()) return found.status();
    const Vector& n = *found;
    if (n.isZero(0)) return absl::OkStatus();
    const double gap_before = gap_at_start(n);
    const double gap = gap_at(gap_before, n, lower_);
    if (!(gap > kLeastRelativeGap * size)) return absl::OkStatus();
    lower_excluded_ = true;
    const double speed = -n.dot(displacement);
    const double until = lower_ + gap / speed * (1 - kOpenShare);
    const bool to_end = !(speed > 0) || !(until < 1);
    if (!(gap_at(gap_before, n, to_end ? 1 : until) > 0)) return absl::OkStatus();
    if (to_end) {
      TakeSeparatedFrom(lower_, n);
      return absl::OkStatus();
    }
    if (!(until > lower_)) return absl::OkStatus();
    lower_ = until;
    intervals_.push_back({lower_, n, std::nullopt});
    toward = n;
  }
  return absl::OkStatus();
}

// Finds the time exactly if the origin enters a solid C through the inside of the nearest triangle.
absl::Status TranslationSearch::TryFacet() {
  if (upper_state_ != Upper::kUnknown || nearest_.count != 3) return absl::OkStatus();
  ExactPair& pair = middle().pair;
  const IntegerVector& half = middle().half;
  const IntegerVector p = pair.Difference(nearest_.pairs[0]);
  const IntegerVector q = pair.Difference(nearest_.pairs[1]);
  const IntegerVector r = pair.Difference(nearest_.pairs[2]);
  // The sides of the path on which the edges pass.
  const int side = Sign(Dot(half, Cross(p, q)));
  if (side == 0 || Sign(Dot(half, Cross(q, r))) != side || Sign(Dot(half, Cross(r, p))) != side) {
    return absl::OkStatus();
  }
  IntegerVector n = Cross(q - p, r - p);
  if (Sign(Dot(n, half)) > 0) n = -n;
  const Integer speed = Dot(n, half);
  const Integer reach = Dot(n, p);
  const bool is_facet = Dot(n, pair.Farthest(n).w) == reach && SpanOf(pair).dimension == 3;
  if (pair.stopped()) return MotionStopped();
  // Before time 0 or at the end, the other steps decide.
  if (!is_facet || speed.is_zero() || Sign(-reach - speed) < 0) return absl::OkStatus();
  const FloorTime entry = RoundDown(-reach - speed, -2 * speed);
  if (entry.value == 1) return absl::OkStatus();
  lower_ = entry.value;
  lower_excluded_ = !entry.exact;
  intervals_ = {{lower_, std::move(n), std::nullopt}};
  upper_ = entry.exact ? lower_ : std::nextafter(lower_, 1.0);
  upper_state_ = Upper::kContact;
  relation_ = Relation::kOverlapping;
  return absl::OkStatus();
}

// Queries until lower_ and upper_ are equal or adjacent.
absl::Status TranslationSearch::Narrow() {
  for (;;) {
    if (upper_state_ != Upper::kUnknown) {
      if (lower_ >= upper_) return absl::OkStatus();
      if (lower_excluded_ && OrdinalOf(upper_) - OrdinalOf(lower_) == 1) {
        // A pair that overlaps at upper_ met before. One that touches may have met at upper_.
        const bool may_meet_at_upper =
            upper_state_ == Upper::kContact && relation_ == Relation::kTouching;
        if (!may_meet_at_upper || raised_) return absl::OkStatus();
        if (absl::Status s = RaiseToNearest(); !s.ok()) return s;
        continue;
      }
    }
    if (absl::Status s = QueryAt(NextTime()); !s.ok()) return s;
  }
}

// Takes the direction in which the pair is nearest at lower_. So close to the contact, its plane
// holds a face, edge, or vertex of C that the origin meets first.
absl::Status TranslationSearch::RaiseToNearest() {
  raised_ = true;
  const PairAt at(a_, b_, lower_);
  absl::StatusOr<IntegerVector> n = ExactNearestDirection(at.pair(), options_.should_stop);
  if (!n.ok()) return n.status();
  return TakeSeparating(lower_, *std::move(n));
}

double TranslationSearch::NextTime() const {
  if (!lower_excluded_) return lower_;
  const int64_t low = OrdinalOf(lower_);
  const int64_t high = OrdinalOf(upper_);
  const int64_t farthest = upper_state_ == Upper::kUnknown ? high : low + (high - low) / 2;
  return DoubleAt(std::min(low + stride_, farthest));
}

absl::Status TranslationSearch::QueryAt(double time) {
  if (poll_.Step()) return MotionStopped();
  const int64_t longest = OrdinalOf(1.0);
  stride_ = stride_ > longest / kStrideFactor ? longest : stride_ * kStrideFactor;
  const PairAt at(a_, b_, time);
  absl::StatusOr<Decision> decision = at.DecideCores(options_.should_stop);
  if (!decision.ok()) return decision.status();
  if (decision->relation != Relation::kSeparated) {
    upper_ = time;
    upper_state_ = Upper::kContact;
    relation_ = decision->relation;
    return absl::OkStatus();
  }
  if (const Vector* n = std::get_if<Vector>(&decision->axis)) return TakeSeparating(time, *n);
  return TakeSeparating(time, std::get<IntegerVector>(std::move(decision->axis)));
}

// Takes a direction that separates the pair at a time.
absl::Status TranslationSearch::TakeSeparating(double time, Direction direction) {
  const IntegerVector n = ToExact(direction);
  const Integer speed = Dot(n, middle().half);
  if (Sign(speed) >= 0) {
    // Without motion along the direction, it separates at all times.
    TakeSeparatedFrom(speed.is_zero() ? 0 : time, std::move(direction));
    return absl::OkStatus();
  }
  // n.(w - (2 t - 1) half) < 0 for all w of C at the middle, and at the end of this interval 0 for
  // one of them.
  const Integer reach = Dot(n, middle().pair.Farthest(n).w);
  if (middle().pair.stopped()) return MotionStopped();
  const FloorTime until = RoundDown(-reach - speed, -2 * speed);
  HULLD_CHECK(until.value > time || (until.value == time && !until.exact));
  if (until.value == 1 && !until.exact) {
    TakeSeparatedFrom(0, std::move(direction));
    return absl::OkStatus();
  }
  if (until.value > time && restarts_left_ > 0) {
    --restarts_left_;
    stride_ = 1;
  }
  lower_ = until.value;
  lower_excluded_ = !until.exact;
  intervals_ = {{lower_, std::move(direction), std::nullopt}};
  return absl::OkStatus();
}

void TranslationSearch::TakeSeparatedFrom(double time, Direction direction) {
  upper_ = time;
  upper_state_ = Upper::kSeparatedAfter;
  after_ = std::move(direction);
}

absl::StatusOr<FirstContact> TranslationSearch::Conclude() {
  // A plane that only touches at lower_ proves nothing there, but the swept pair has a better one.
  const bool covered = upper_ < lower_ || (upper_ == lower_ && (lower_excluded_ || upper_ == 0));
  if (upper_state_ == Upper::kSeparatedAfter && covered) return Separated();
  if (upper_state_ == Upper::kSeparatedAfter || relation_ == Relation::kTouching) {
    // A pair without motion touches at all times.
    if (!IsZero(middle().half)) {
      absl::StatusOr<SweptRelation> swept =
          FindSweptRelation(middle().pair, middle().half, options_.should_stop);
      if (!swept.ok()) return swept.status();
      if (swept->relation == Relation::kSeparated) {
        TakeSeparatedFrom(0, *std::move(swept->axis));
        return Separated();
      }
      relation_ = swept->relation;
    }
  }
  FirstContact contact;
  contact.relation = relation_;
  contact.separated_until = lower_;
  contact.contact_time = upper_;
  if (options_.want_certificate) {
    if (absl::Status s = AddCertificate(contact); !s.ok()) return s;
  }
  return contact;
}

FirstContact TranslationSearch::Separated() {
  FirstContact contact;
  if (!options_.want_certificate) return contact;
  if (upper_ > 0) {
    contact.intervals = std::move(intervals_);
    contact.intervals.back().until = upper_;
  }
  contact.intervals.push_back({1, *std::move(after_), std::nullopt});
  return contact;
}

absl::Status TranslationSearch::AddCertificate(FirstContact& contact) {
  if (lower_ > 0) contact.intervals = std::move(intervals_);
  absl::StatusOr<Answer> answer =
      PairAt(a_, b_, upper_).Check(/*want_certificate=*/true, options_.should_stop);
  if (!answer.ok()) return answer.status();
  if (answer->relation != Relation::kSeparated) {
    contact.certificate = std::move(answer->certificate);
    return absl::OkStatus();
  }
  // The contact has ended.
  absl::StatusOr<ExactNearest> nearest =
      FindNearestExactly(middle().pair, {}, options_.should_stop, &middle().half);
  if (!nearest.ok()) return nearest.status();
  contact.certificate = Certificate{{}, std::move(nearest->point.pairs)};
  return absl::OkStatus();
}

}  // namespace hulld
