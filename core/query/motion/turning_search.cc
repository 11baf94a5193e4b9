#include "core/query/motion/turning_search.h"

#include <absl/status/status.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/numeric/error_bounds.h"
#include "core/numeric/expansion.h"
#include "core/query/motion/nearest_direction.h"
#include "core/query/motion/pair_at.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/terms/answer.h"

namespace hulld {
namespace {

// A step ends when this share of its gap is left, or, once it has made progress, after this many
// trials. Not tuned.
constexpr double kLeftShare = 0x1p-5;
constexpr int kMaxTrials = 10;
// A plane that turns replaces a constant one if, at the end of the latter, this share of its gap is
// left along the nearest direction. Not tuned.
constexpr double kTurnedShare = 0.5;
// A plane turns by less than 60 degrees, so that its normal, linear in time, keeps more than 0.86
// of its length. Not tuned.
constexpr double kMinCosine = 0.5;
// Trials keep this share of an interval away from its ends. Not tuned.
constexpr double kMinShare = 0x1p-4;
// Share of the last step over which the rate of the gap is measured. Not tuned.
constexpr double kRateShare = 0x1p-10;
// A leap leaves at least this share of the distance to the likely contact, and at least this
// multiple of the error expected from the error of the last leap. Not tuned.
constexpr double kMinLeftShare = 0x1p-20;
constexpr double kLeapSlack = 8;
// A bracket below this width is narrow. Not tuned.
constexpr double kNarrowBracket = 0x1p-20;
// Maximum number of times at which a passage is cut, and minimum share of an interval on either
// side of a cut. Not tuned.
constexpr int kMaxCuts = 10;
constexpr double kMinCutShare = 0x1p-5;
// Two directions count as equal if the gaps along them differ by less than this share. Not tuned.
constexpr double kSameShare = 0x1p-6;
// Factor between the lengths of successive steps, at first trial. Not tuned.
constexpr double kGrowth = 4;
// A tolerable step shorter than this makes no progress. Not tuned.
constexpr double kShortestStep = 0x1p-50;
// Between hulls that are nearer than this share of their size, a step shorter than the second share
// of the last step may be due to the error of a floating-point direction. Not tuned.
constexpr double kExactShare = 0x1p-36;
constexpr double kPoorShare = 0x1p-8;
// An exact direction is expensive: only this many trials of a step compute one at their end, and
// steps below this length or this share of the last one, whichever is less, are abandoned. Not
// tuned.
constexpr int kMaxExactTrials = 10;
constexpr double kShortestExactStep = 0x1p-40;
constexpr double kShortestExactShare = 0x1p-12;
// The search does not try tolerable planes if a contact is likely to be this many times as deep as
// the resolution. Not tuned.
constexpr double kDeepShare = 64;
// After the search is stuck, and before it tries tolerable planes, it looks for a contact at this
// many times, each farther away by this factor. Not tuned.
constexpr int kMaxSoonTimes = 8;
constexpr double kSoonGrowth = 4;
// Before the search is stuck, it does not try tolerable steps below this share of the last length.
// Not tuned.
constexpr double kMinTolerableShare = 0x1p-8;

// Returns a time shortly before the gap would close, between `proven`, at which a plane is proven
// with `gap`, and `failed`, at which the plane fails with `failed_gap`. The loss of a plane is
// linear in time if its direction is constant, and quadratic if it turns.
double TrialBetween(double proven, double gap, double failed, double failed_gap, bool turned) {
  const double length = failed - proven;
  const double lost = gap / (gap - failed_gap);
  const double share = (turned ? std::sqrt(lost) : lost) * (1 - kLeftShare / 2);
  if (!(share > 0)) return proven + length / 2;
  return proven + length * std::clamp(share, kMinShare, 1 - kMinShare);
}

// Returns a unit direction within 54 degrees of m: n, or else the direction between m and n that is
// nearest to n.
Vector TurnedToward(const PlainVector& m, const PlainVector& n) {
  constexpr double kCosine = 0.6;
  constexpr double kSine = 0.8;
  constexpr double kMinSine = 0x1p-4;
  const double cosine = Dot(m, n);
  if (cosine >= kCosine) return n;
  const PlainVector across = n - cosine * m;
  const double sine = Norm(across);
  if (!(sine > kMinSine)) return m;
  const PlainVector turned = kCosine * m + kSine / sine * across;
  return 1 / Norm(turned) * turned;
}

// Returns the smallest positive root of a + b x + c x^2, or infinity. Requires: a > 0.
double SmallestRoot(double a, double b, double c) {
  const double squared = b * b - 4 * a * c;
  if (!(squared >= 0)) return kInfinity;
  const double root = 2 * a / (std::sqrt(squared) - b);
  return root > 0 ? root : kInfinity;
}

}  // namespace

TurningSearch::TurningSearch(const MovingHull& a, const MovingHull& b, const MotionOptions& options)
    : a_(a), b_(b), options_(options), poll_(options.should_stop, 1), plane_(a, b), rounded_(a, b) {
  const auto size_of = [](const MovingHull& moving) {
    return moving.hull.max_abs_coordinate() + (moving.radius + moving.piece_radius);
  };
  const double sizes = size_of(a) + size_of(b);
  resolution_ = std::max(options.resolution.value_or(kDefaultRelativeResolution * sizes),
                         kMinRelativeResolution * plane_.size());
}

absl::StatusOr<FirstContact> TurningSearch::Run() {
  if (absl::Status s = ProvePassage(); !s.ok()) return s;
  bool may_tolerate = true;
  while (separated_ < 1 && separated_ <= options_.latest) {
    if (poll_.Step()) return MotionStopped();
    absl::StatusOr<std::optional<Step>> found = NextStep();
    if (!found.ok()) return found.status();
    if (!*found || IsPoor(**found)) {
      if (!*found && separated_ == 0) {
        const absl::StatusOr<Relation> relation = RelationAt(0);
        if (!relation.ok()) return relation.status();
        if (*relation != Relation::kSeparated) return Contact(0, *relation);
      }
      exact_ = true;
      turns_ = false;
      is_nearest_ = false;
      absl::StatusOr<std::optional<Step>> exact = NextStep();
      if (!exact.ok()) return exact.status();
      if (!*found && !*exact) return ConcludeStuck();
      if (*exact && (!*found || (*exact)->until > (*found)->until)) found = std::move(exact);
    }
    const Step& step = **found;
    Take(step);
    if (separated_ == 1 || separated_ > options_.latest) break;
    // Contact is likely at and after the time at which the plane fails.
    const double latest = LatestContactTime();
    // In a narrow bracket, the later time needs exact arithmetic less often.
    const bool is_narrow = latest - step.failed < kNarrowBracket;
    for (const double time : {is_narrow ? latest : step.failed, is_narrow ? step.failed : latest}) {
      if (step.failed > latest) break;
      const absl::StatusOr<Relation> relation = RelationAt(time);
      if (!relation.ok()) return relation.status();
      if (*relation != Relation::kSeparated) return Contact(time, *relation);
    }
    const bool is_deep = likely_least_gap_ < -kDeepShare * resolution_;
    if (may_tolerate && step.gap <= resolution_ && !is_deep) {
      const absl::StatusOr<bool> stays = StaysWithinResolution();
      if (!stays.ok()) return stays.status();
      if (*stays) return WithoutContact(Relation::kWithinTolerance);
      may_tolerate = false;
    }
  }
  return WithoutContact(Relation::kSeparated);
}

void TurningSearch::Take(const Step& step) {
  if (options_.want_certificate) {
    // Constructed in place, because g++ 12 warns if the variant is moved here.
    SeparatedInterval& interval = intervals_.emplace_back();
    interval.until = step.until;
    interval.direction = step.direction;
    interval.offset = step.plane.found.offset;
    interval.end = {step.plane.end_direction, step.plane.found.end_offset};
  }
  turns_ = step.plane.end_direction != step.direction;
  is_nearest_ = turns_;
  last_length_ = step.until - separated_;
  last_gap_ = step.gap;
  exact_ = exact_ && step.plane.found.gap <= kExactShare * plane_.size();
  direction_ = step.plane.end_direction;
  separated_ = step.until;
}

absl::StatusOr<TurningSearch::Ahead> TurningSearch::LookAt(double time) {
  const absl::StatusOr<Vector> n = DirectionAt(time);
  if (!n.ok()) return n.status();
  return Ahead{time, *n, n->isZero(0) ? 0 : plane_.GapAt(*n, time)};
}

// Proves the separation up to the end or to shortly before a contact, with few planes. While no
// plane between two times is proven, adds a time between them at which the hulls may be nearest.
// Gives up early; intervals_ contains the proven intervals.
absl::Status TurningSearch::ProvePassage() {
  absl::StatusOr<Ahead> from = LookAt(0);
  if (!from.ok()) return from.status();
  direction_ = from->direction;
  is_nearest_ = true;
  if (!(from->gap > 0)) return absl::OkStatus();
  std::array<Ahead, kMaxCuts + 1> ahead;
  size_t count = 0;
  // Independent of options_.latest, so that searches with different latest times take the same
  // steps.
  double next = 1;
  for (int cuts = 0; cuts <= kMaxCuts; ++cuts) {
    if (poll_.Step()) return MotionStopped();
    absl::StatusOr<Ahead> to = LookAt(next);
    if (!to.ok()) return to.status();
    if (!(to->gap > 0)) {
      contact_ = next;
      break;
    }
    ahead[count++] = *to;
    std::optional<double> cut;
    while (count > 0 && !(cut = CutOf(*from, ahead[count - 1]))) *from = ahead[--count];
    if (separated_ > options_.latest) break;
    if (!cut || !(*cut > from->time && *cut < ahead[count - 1].time)) break;
    next = *cut;
  }
  return absl::OkStatus();
}

// Takes a step between two times if it can prove a plane that has the direction at one of them, or
// turns from one direction to the other. Otherwise returns a time between them.
std::optional<double> TurningSearch::CutOf(const Ahead& from, const Ahead& to) {
  const auto try_plane = [&](const Vector& start, const Vector& end) {
    const MovingPlane::Result found = plane_.Try(start, end, from.time, to.time);
    if (!found.proven) return false;
    Take({to.time, start, {found, end}, from.gap, 2});
    direction_ = to.direction;
    is_nearest_ = true;
    return true;
  };
  const double gap_at_end = plane_.GapAt(from.direction, to.time);
  const double gap_at_start = plane_.GapAt(to.direction, from.time);
  if (gap_at_start > 0 && try_plane(to.direction, to.direction)) return std::nullopt;
  if (gap_at_end > 0 && try_plane(from.direction, from.direction)) return std::nullopt;
  // If both gaps were linear in time, the gap along the plane would have these Bernstein
  // coefficients of degree 4, up to factors.
  const double middle = (gap_at_end + gap_at_start) / 2;
  if (from.gap + middle > 0 && (from.gap + to.gap) + 4 * middle > 0 && middle + to.gap > 0) {
    // The end with the larger gap has some to spare.
    const bool starts_wide = from.gap > to.gap;
    const Vector start = starts_wide ? TurnedToward(to.direction, from.direction) : from.direction;
    const Vector end = starts_wide ? to.direction : TurnedToward(from.direction, to.direction);
    if (try_plane(start, end)) return std::nullopt;
  }
  const double length = to.time - from.time;
  const double excess = (from.gap - gap_at_start) + (to.gap - gap_at_end);
  double share = 0.5;
  if (excess > kSameShare * (from.gap + to.gap)) {
    // The time at which both gaps are equal, if they are linear.
    share = (from.gap - gap_at_start) / excess;
  } else {
    // The minimum of a parabola.
    const double soon = from.time + kRateShare * length;
    const double rate = (plane_.GapAt(from.direction, soon) - from.gap) / kRateShare;
    const double curvature = gap_at_end - from.gap - rate;
    if (rate < 0 && curvature > 0) share = -rate / (2 * curvature);
  }
  return from.time + std::clamp(share, kMinCutShare, 1 - kMinCutShare) * length;
}

absl::StatusOr<Relation> TurningSearch::RelationAt(double time) const {
  const absl::StatusOr<Answer> answer =
      PairAt(a_, b_, time).Check(/*want_certificate=*/false, options_.should_stop);
  if (!answer.ok()) return answer.status();
  return answer->relation;
}

absl::StatusOr<Vector> TurningSearch::DirectionAt(double time) {
  if (!plane_.IsUsableAt(time)) return Vector(Vector::Zero());
  if (exact_) {
    return ExactNearestUnit(PairAt(a_, b_, time).pair(), nearest_pairs_, options_.should_stop);
  }
  // Rounded like the plane that will use this direction.
  const FloatPair& pair = rounded_.At(plane_.PoseOfA(time), plane_.PoseOfB(time));
  const Vector first = direction_.isZero(0) ? Vector(-Vector(pair.CenterDifference())) : direction_;
  if (pair.usable() && first.isZero(0)) return Vector(Vector::UnitX());
  return NearestDirection(pair, first, nearest_pairs_, options_.should_stop);
}

// Tries a plane of constant direction n and, if it fails and `turns`, one that turns from n to the
// nearest direction at the end.
absl::StatusOr<TurningSearch::Plane> TurningSearch::TryPlane(const Vector& n, double start,
                                                             double end, bool turns,
                                                             double margin) {
  Plane plane = {plane_.Try(n, n, start, end, margin), n};
  if (plane.found.proven || !turns) return plane;
  const absl::StatusOr<Vector> at_end = DirectionAt(end);
  if (!at_end.ok()) return at_end.status();
  if (!(n.dot(*at_end) > kMinCosine)) return plane;
  const MovingPlane::Result turned = plane_.Try(n, *at_end, start, end, margin);
  if (turned.gap > plane.found.gap) plane = {turned, *at_end};
  return plane;
}

// Returns a step from separated_ along the nearest direction, or none if no progress is possible.
absl::StatusOr<std::optional<TurningSearch::Step>> TurningSearch::NextStep() {
  if (!is_nearest_) {
    const absl::StatusOr<Vector> n = DirectionAt(separated_);
    if (!n.ok()) return n.status();
    direction_ = *n;
  }
  return FindStep(direction_);
}

// Returns true if an exact direction may allow a much longer step.
bool TurningSearch::IsPoor(const Step& step) const {
  // If the gap closes as before, this share of the last length is left to the contact.
  const double left = last_gap_ < kInfinity ? std::min(1.0, step.gap / last_gap_) : 1;
  return !exact_ && step.gap <= kExactShare * plane_.size() &&
         step.until - separated_ < kPoorShare * left * last_length_;
}

// Returns a time at which contact is likely, with `gap` along the nearest direction n: the zero of
// the parabola through this gap and the last one with the current rate. Infinite if there is none.
double TurningSearch::LikelyContact(const Vector& n, double gap) {
  if (!(last_gap_ < kInfinity)) return kInfinity;
  const double soon = std::min(1.0, separated_ + kRateShare * last_length_);
  if (!plane_.IsUsableAt(soon)) return kInfinity;
  const double rate = (plane_.GapAt(n, soon) - gap) / (soon - separated_);
  const double curvature = (last_gap_ - gap + rate * last_length_) / (last_length_ * last_length_);
  likely_least_gap_ = curvature > 0 ? gap - rate * rate / (4 * curvature) : -kInfinity;
  return separated_ + SmallestRoot(gap, rate, curvature);
}

// Tries a step with a turning plane to shortly before a likely time of contact.
absl::StatusOr<std::optional<TurningSearch::Step>> TurningSearch::LeapTo(double contact,
                                                                         const Vector& n,
                                                                         double gap) {
  const double length = contact - separated_;
  double share = std::min(kLeftShare, length / last_length_);
  if (leap_length_ > 0) {
    // The error of a parabola, as a share of the length, falls at least linearly with the length.
    const double error = std::abs(contact - likely_contact_) / leap_length_;
    share = std::min(share, std::max(kLeapSlack * error * (length / leap_length_), kMinLeftShare));
  }
  const double until = contact - std::max(share * length, options_.max_time_error / 4);
  if (!(until > separated_ && until <= 1)) return std::nullopt;
  const absl::StatusOr<Vector> at_end = DirectionAt(until);
  if (!at_end.ok()) return at_end.status();
  if (!(n.dot(*at_end) > kMinCosine)) return std::nullopt;
  const MovingPlane::Result turned = plane_.Try(n, *at_end, separated_, until);
  // Past a graze, the gap does not nearly close.
  if (!turned.proven || turned.end_gap > 4 * kLeftShare * gap) return std::nullopt;
  likely_contact_ = contact;
  leap_length_ = length;
  failed_leaps_ = 0;
  return Step{until, n, {turned, *at_end}, gap, contact};
}

// Returns a long interval with a proven plane that has direction n at its start, or none if there
// is no progress.
absl::StatusOr<std::optional<TurningSearch::Step>> TurningSearch::FindStep(const Vector& n) {
  if (n.isZero(0)) return std::nullopt;
  // Accurate up to rounding; excludes the error bound.
  const double gap = plane_.GapAt(n, separated_);
  MovingPlane::Result start{.gap = gap, .end_gap = gap};
  if (!(gap > kExactShare * plane_.size())) {
    start = plane_.Try(n, n, separated_, separated_);
    if (!start.proven) return std::nullopt;
  }
  if (steps_to_leap_ > 0) {
    --steps_to_leap_;
  } else {
    const double contact = LikelyContact(n, gap);
    if (contact <= separated_ + last_length_) {
      const absl::StatusOr<std::optional<Step>> leap = LeapTo(contact, n, gap);
      if (!leap.ok() || *leap) return leap;
      steps_to_leap_ = ++failed_leaps_;
      leap_length_ = 0;
    }
  }
  turns_ = turns_ || gap > kTurnedShare * last_gap_;
  Step step = {separated_, n, {start, n}, gap, 2};
  Plane failed = step.plane;
  double trial = std::min(1.0, separated_ + kGrowth * last_length_);
  if (contact_ > separated_ && contact_ <= trial) {
    trial = contact_;
    const double gap_there = plane_.IsUsableAt(contact_) ? plane_.GapAt(n, contact_) : kInfinity;
    if (gap_there <= 0) {
      // No plane is proven up to this time.
      step.failed = contact_;
      failed.found.gap = gap_there;
      trial = TrialBetween(separated_, start.gap, contact_, gap_there, /*turned=*/false);
    }
  }
  const double shortest = std::min(kShortestExactStep, kShortestExactShare * last_length_);
  for (int i = 0; i < kMaxTrials || step.until == separated_; ++i) {
    if (!(trial > step.until) || trial == step.failed) break;
    if (exact_ && trial - separated_ < shortest) break;
    const bool turns = turns_ && (!exact_ || i < kMaxExactTrials);
    const absl::StatusOr<Plane> plane = TryPlane(n, separated_, trial, turns);
    if (!plane.ok()) return plane.status();
    if (plane->found.proven) {
      step.until = trial;
      step.plane = *plane;
      const bool turned = plane->end_direction != n;
      if (trial == 1 || plane->found.gap <= kLeftShare * start.gap) break;
      if (turned && step.failed <= 1) break;
    } else {
      step.failed = trial;
      failed = *plane;
    }
    trial = step.failed > 1 ? std::min(1.0, separated_ + kGrowth * (step.until - separated_))
                            : TrialBetween(step.until, step.plane.found.gap, step.failed,
                                           failed.found.gap, failed.end_direction != n);
  }
  if (step.until == separated_) return std::nullopt;
  return step;
}

// Returns the latest time that is within max_time_error of separated_, but at least the next
// double.
double TurningSearch::LatestContactTime() const {
  double latest = std::min(1.0, separated_ + options_.max_time_error);
  const SumWithError width = TwoSum(latest, -separated_);
  const bool is_wider = width.sum > options_.max_time_error ||
                        (width.sum == options_.max_time_error && width.error > 0);
  if (is_wider) latest = std::nextafter(latest, 0.0);
  return latest > separated_ ? latest : std::nextafter(separated_, 2.0);
}

// Returns true if the pair is within the resolution at separated_, apart at the end, and proven to
// be at least -resolution_ apart in between.
absl::StatusOr<bool> TurningSearch::StaysWithinResolution() {
  // The gap along a direction may be less than the separation.
  const absl::StatusOr<bool> near =
      PairAt(a_, b_, separated_).IsWithin(resolution_, options_.should_stop);
  if (!near.ok() || !*near) return near;
  const absl::StatusOr<Relation> at_end = RelationAt(1);
  if (!at_end.ok()) return at_end.status();
  if (*at_end != Relation::kSeparated) return false;
  // Exact directions would rarely decide a search that is not thorough.
  const bool was_exact = std::exchange(exact_, false);
  const absl::StatusOr<double> tolerable = TolerableUntil(/*thorough=*/false);
  exact_ = was_exact;
  if (!tolerable.ok()) return tolerable.status();
  return *tolerable == 1;
}

// Returns a time such that the separation is proven to be at least -resolution_ from separated_ to
// that time; if `thorough`, usually the latest such time.
absl::StatusOr<double> TurningSearch::TolerableUntil(bool thorough) {
  // Twice this, divided by the minimum length of a normal, is within the resolution.
  const double margin = -0.4 * resolution_;
  Vector n = direction_;
  double time = separated_;
  double length = last_length_;
  const double shortest =
      thorough ? kShortestStep : std::max(kShortestStep, kMinTolerableShare * last_length_);
  while (time < 1) {
    if (poll_.Step()) return MotionStopped();
    double until = std::min(1.0, time + kGrowth * length);
    const double poor = exact_ || !thorough ? shortest : std::max(shortest, kPoorShare * length);
    absl::StatusOr<Plane> plane;
    for (;; until = time + (until - time) / 2) {
      plane = TryPlane(n, time, until, /*turns=*/true, margin);
      if (!plane.ok()) return plane.status();
      if (plane->found.proven || until - time < poor) break;
    }
    if (!plane->found.proven) {
      if (exact_ || !thorough) return time;
      exact_ = true;
      const absl::StatusOr<Vector> exact = DirectionAt(time);
      if (!exact.ok()) return exact.status();
      if (!exact->isZero(0)) n = *exact;
      continue;
    }
    length = until - time;
    time = until;
    n = plane->end_direction;
    exact_ = exact_ && std::abs(plane->found.gap) <= kExactShare * plane_.size();
    const absl::StatusOr<Vector> nearest = DirectionAt(time);
    if (!nearest.ok()) return nearest.status();
    // The nearest direction is unreliable if the hulls meet; the previous one may then be better.
    if (!nearest->isZero(0) &&
        plane_.Try(*nearest, *nearest, time, time).gap > plane_.Try(n, n, time, time).gap) {
      n = *nearest;
    }
  }
  return time;
}

// Concludes a search in which no plane can be proven from separated_ on. If planes are usable, the
// gap is then below the rounding error.
absl::StatusOr<FirstContact> TurningSearch::ConcludeStuck() {
  const double latest = LatestContactTime();
  const absl::StatusOr<Relation> relation = RelationAt(latest);
  if (!relation.ok()) return relation.status();
  if (*relation != Relation::kSeparated) return Contact(latest, *relation);
  // If planes are unusable, the hulls may be far apart before they meet.
  absl::StatusOr<bool> near = plane_.IsUsableAt(separated_);
  if (*near) near = PairAt(a_, b_, separated_).IsWithin(resolution_, options_.should_stop);
  if (!near.ok()) return near.status();
  if (*near) {
    const absl::StatusOr<double> soon = FindContactSoon(latest);
    if (!soon.ok()) return soon.status();
    if (*soon <= 1) {
      const absl::StatusOr<Relation> met = RelationAt(*soon);
      if (!met.ok()) return met.status();
      return Contact(*soon, *met);
    }
    const absl::StatusOr<double> tolerable = TolerableUntil(/*thorough=*/true);
    if (!tolerable.ok()) return tolerable.status();
    const absl::StatusOr<double> contact = FindLateContact(*tolerable);
    if (!contact.ok()) return contact.status();
    if (*contact <= 1) {
      const absl::StatusOr<Relation> met = RelationAt(*contact);
      if (!met.ok()) return met.status();
      return Contact(*contact, *met);
    }
    if (*tolerable == 1) return WithoutContact(Relation::kWithinTolerance);
  }
  return absl::InvalidArgumentError(
      "no separation can be proven between pose and end_pose: a rotation nearly vanishes (add a "
      "pose "
      "between them), or coordinates or translations exceed 2^900 or are all below 2^-700 (rescale "
      "them)");
}

// Returns a time of contact, an early one if that is cheap to find. Returns a time above 1 if none
// is found soon, or if the hulls, which are apart at `latest`, first move farther apart than the
// resolution.
absl::StatusOr<double> TurningSearch::FindContactSoon(double latest) const {
  double time = latest;
  for (int i = 0; i < kMaxSoonTimes && time < 1; ++i) {
    const absl::StatusOr<bool> near =
        PairAt(a_, b_, time).IsWithin(resolution_, options_.should_stop);
    if (!near.ok()) return near.status();
    if (!*near) return 2;
    time = std::min(1.0, separated_ + kSoonGrowth * (time - separated_));
    const absl::StatusOr<Relation> relation = RelationAt(time);
    if (!relation.ok()) return relation.status();
    if (*relation != Relation::kSeparated) return FindEarlierContact(time);
  }
  return 2;
}

// Returns a time of contact, an early one if that is cheap to find, or a time above 1 if none is
// found. Between separated_ and the result, the separation is below rounding and not proven. The
// hulls probably meet at `likely` or soon after.
absl::StatusOr<double> TurningSearch::FindLateContact(double likely) const {
  for (double length = 0;; length = std::max(kShortestStep, kGrowth * length)) {
    const double time = std::min(1.0, likely + length);
    const absl::StatusOr<Relation> relation = RelationAt(time);
    if (!relation.ok()) return relation.status();
    if (*relation != Relation::kSeparated) return FindEarlierContact(time);
    if (time == 1) return 2;
  }
}

// Returns a time of contact at most max_time_error after a time without contact, if doubles allow
// it. `contact`: a time of contact.
absl::StatusOr<double> TurningSearch::FindEarlierContact(double contact) const {
  double apart = separated_;
  while (contact - apart > options_.max_time_error) {
    const double time = apart + (contact - apart) / 2;
    if (!(time > apart && time < contact)) break;
    const absl::StatusOr<Relation> relation = RelationAt(time);
    if (!relation.ok()) return relation.status();
    (*relation == Relation::kSeparated ? apart : contact) = time;
  }
  return contact;
}

absl::StatusOr<FirstContact> TurningSearch::Contact(double time, Relation relation) {
  FirstContact contact = WithoutContact(relation);
  contact.contact_time = time;
  if (options_.want_certificate) {
    absl::StatusOr<Answer> answer =
        PairAt(a_, b_, time).Check(/*want_certificate=*/true, options_.should_stop);
    if (!answer.ok()) return answer.status();
    contact.certificate = std::move(answer->certificate);
  }
  return contact;
}

FirstContact TurningSearch::WithoutContact(Relation relation) {
  FirstContact contact;
  contact.relation = relation;
  contact.separated_until = separated_;
  contact.intervals = std::move(intervals_);
  return contact;
}

}  // namespace hulld
