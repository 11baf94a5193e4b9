#include "core/query/motion/translation_search.h"

#include <absl/status/status.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/rational.h"
#include "core/query/exact/exact_nearest.h"
#include "core/query/exact/exact_search.h"
#include "core/query/floating/facet_entry.h"
#include "core/query/floating/float_pair.h"
#include "core/query/floating/path_cast.h"
#include "core/query/ladder.h"
#include "core/query/motion/nearest_direction.h"
#include "core/query/motion/sweep.h"
#include "core/query/terms/separation_bounds.h"

namespace hulld {
namespace {

// Factor between the strides of successive exact queries. Not tuned.
constexpr int64_t kStrideFactor = 16;

// Returns the position of a double among the non-negative doubles, in ascending order.
int64_t OrdinalOf(double x) { return std::bit_cast<int64_t>(x); }
double DoubleAt(int64_t ordinal) { return std::bit_cast<double>(ordinal); }

// A rational number in [0, 1], rounded down.
struct FloorTime {
  double value;
  bool exact;
};

// Requires: numerator >= 0, denominator > 0. Rounds numbers above 1 to 1.
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

// A time in [0, 1] as a fraction, numerator / 2^bits.
struct BinaryTime {
  Integer numerator;
  int bits;
};
BinaryTime ToBinary(double time) {
  const int bits = time == 0 ? 0 : std::max(0, -LowestBitExponent(time));
  return {ToInteger(time, -bits), bits};
}

IntegerVector Shifted(const IntegerVector& v, int bits) {
  return {v.x << bits, v.y << bits, v.z << bits};
}

int SignOfDeterminant(const IntegerVector& p, const IntegerVector& q, const IntegerVector& r) {
  return Sign(Dot(p, Cross(q, r)));
}

// Returns true if the origin is strictly inside the tetrahedron.
bool IsInside(const IntegerVector& p, const IntegerVector& q, const IntegerVector& r,
              const IntegerVector& s) {
  const int side = SignOfDeterminant(p, q, r);
  return side != 0 && SignOfDeterminant(p, r, s) == side && SignOfDeterminant(p, s, q) == side &&
         SignOfDeterminant(q, s, r) == side;
}

}  // namespace

// Half of each translation is a multiple of the unit of the pair at time 1/2.
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
  if (poll_.Step()) return MotionStopped();
  Cast();
  if (absl::Status s = TryFacet(); !s.ok()) return s;
  if (absl::Status s = Narrow(); !s.ok()) return s;
  return Conclude();
}

void TranslationSearch::Cast() {
  const FloatPair& start = start_.pair();
  const RelativePath path(start, a_.X_WB, b_.X_WB);
  if (!start.usable() || !IsFilterSize(path.size)) return;
  const PathCast cast = CastPath(start, path);
  if (cast.outcome == PathCast::Outcome::kSeparated) return TakeSeparatedFrom(0, cast.direction);
  if (cast.outcome == PathCast::Outcome::kFacet) {
    facet_ = cast.facet;
    // Certificates need the exact normal.
    const std::optional<BetweenTimes> entry =
        options_.want_certificate ? std::nullopt
                                  : FindEntry(start, path, a_.X_WB, b_.X_WB, *facet_);
    if (entry) return TakeEntry(entry->before, entry->after, Relation::kOverlapping);
  }
  if (cast.separated_until > 0) {
    lower_ = cast.separated_until;
    lower_excluded_ = true;
    intervals_ = {{lower_, cast.direction, std::nullopt}};
  }
}

void TranslationSearch::TakeEntry(double before, double after, Relation relation) {
  lower_ = before;
  lower_excluded_ = before < after;
  upper_ = after;
  upper_state_ = Upper::kContact;
  relation_ = relation;
  // No direction at lower_ is better.
  raised_ = true;
}

// Finds the time exactly if the origin enters C through the triangle at which the cast ended. If
// the line of the path crosses the border of the triangle, or C is flat, the path may only graze C.
absl::Status TranslationSearch::TryFacet() {
  if (upper_state_ != Upper::kUnknown || !facet_) return absl::OkStatus();
  ExactPair pair(start_.pair(), options_.should_stop);
  const IntegerVector p = pair.Difference((*facet_)[0]);
  const IntegerVector q = pair.Difference((*facet_)[1]);
  const IntegerVector r = pair.Difference((*facet_)[2]);
  // The displacement, in the unit of the pair divided by 2^shift.
  const Vector& end_a = a_.X_WB.end.t;
  const Vector& end_b = b_.X_WB.end.t;
  const int exponent = LowestBitExponent(end_a, LowestBitExponent(end_b, pair.exponent()));
  const int shift = pair.exponent() - exponent;
  const IntegerVector of_a = ToInteger(end_a, exponent) - ToInteger(a_.X_WB.start.t, exponent);
  const IntegerVector of_b = ToInteger(end_b, exponent) - ToInteger(b_.X_WB.start.t, exponent);
  const IntegerVector d = pair.norm() * (of_b - of_a);
  // The sides of the path on which the edges pass.
  const auto [min, max] = std::minmax(
      {SignOfDeterminant(d, p, q), SignOfDeterminant(d, q, r), SignOfDeterminant(d, r, p)});
  if (min < 0 && max > 0) return absl::OkStatus();
  IntegerVector n = Cross(q - p, r - p);
  Integer speed = Dot(n, d);
  if (Sign(speed) > 0) {
    n = -n;
    speed = -speed;
  }
  const Integer reach = Dot(n, p);
  const bool is_facet = !speed.is_zero() && Dot(n, pair.Farthest(n).w) == reach;
  if (pair.stopped()) return MotionStopped();
  // If the time is before 0 or at the end, the other steps decide.
  if (!is_facet || Sign(reach) > 0) return absl::OkStatus();
  const FloorTime entry = RoundDown(-reach << shift, -speed);
  if (entry.value == 1) return absl::OkStatus();
  const bool is_inside = min * max != 0 && SpanOf(pair).dimension == 3;
  TakeEntry(entry.value, entry.exact ? entry.value : std::nextafter(entry.value, 1.0),
            is_inside ? Relation::kOverlapping : Relation::kTouching);
  if (options_.want_certificate && entry.exact) {
    proof_ = Certificate{n, {facet_->begin(), facet_->end()}};
  } else if (options_.want_certificate) {
    const ExactCorner inner = pair.Farthest(-n);
    const BinaryTime time = ToBinary(upper_);
    const auto at_upper = [&](const IntegerVector& w) {
      return Shifted(w, shift + time.bits) - time.numerator * d;
    };
    if (IsInside(at_upper(p), at_upper(q), at_upper(r), at_upper(inner.w))) {
      proof_ = Certificate{{}, {(*facet_)[0], (*facet_)[1], (*facet_)[2], inner.pair}};
    }
  }
  intervals_ = {{lower_, std::move(n), std::nullopt}};
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

// Takes the direction in which the pair is nearest at lower_. This close to the contact, its plane
// contains the face, edge, or vertex of C that the origin meets first.
absl::Status TranslationSearch::RaiseToNearest() {
  raised_ = true;
  const PairAt at(a_, b_, lower_);
  FloatCombination nearest;
  absl::StatusOr<IntegerVector> n = ExactNearestDirection(at.pair(), nearest, options_.should_stop);
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
  const auto is_at_rest = [](const Motion& motion) { return motion.start.t == motion.end.t; };
  if (is_at_rest(a_.X_WB) && is_at_rest(b_.X_WB)) {
    TakeSeparatedFrom(0, std::move(direction));
    return absl::OkStatus();
  }
  const IntegerVector n = ToExact(direction);
  const Integer speed = Dot(n, middle().half);
  if (Sign(speed) >= 0) {
    // Without motion along it, the direction separates the pair at all times.
    TakeSeparatedFrom(speed.is_zero() ? 0 : time, std::move(direction));
    return absl::OkStatus();
  }
  // For t in this interval, n.(w - (2 t - 1) half) < 0 for all w of C at time 1/2; at its end, this
  // is 0 for one w.
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
  // A plane that only touches at lower_ does not prove separation there; the swept pair has a
  // better one.
  const bool covered = upper_ < lower_ || (upper_ == lower_ && (lower_excluded_ || upper_ == 0));
  if (upper_state_ == Upper::kSeparatedAfter && covered) return Separated();
  if (upper_state_ == Upper::kSeparatedAfter || relation_ == Relation::kTouching) {
    // A pair without relative motion touches at all times.
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
  if (proof_) {
    contact.certificate = *std::move(proof_);
    return absl::OkStatus();
  }
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
