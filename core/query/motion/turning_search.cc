#include "core/query/motion/turning_search.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/numeric/error_bounds.h"
#include "core/numeric/expansion.h"
#include "core/query/motion/nearest_direction.h"
#include "core/query/motion/pair_at.h"
#include "core/query/terms/answer.h"

namespace hulld {
namespace {

// A step ends when this share of its gap is left, or, once it makes progress, after this many
// trials. Choices.
constexpr double kLeftShare = 0x1p-5;
constexpr int kMostTrials = 10;
// Trials keep this share of an interval away from its ends. A choice.
constexpr double kLeastShare = 0x1p-4;
// Factor between the lengths of successive steps, at first trial. A choice.
constexpr double kGrowth = 4;
// A tolerable step that is shorter than this makes no progress. A choice.
constexpr double kShortestStep = 0x1p-50;

// Returns a time between two at which a plane is proven, with gap `gap`, and not proven, with
// `failed_gap`: shortly before a linear gap would close.
double TrialBetween(double proven, double gap, double failed, double failed_gap) {
  const double length = failed - proven;
  const double share = gap / (gap - failed_gap) * (1 - kLeftShare / 2);
  if (!(share > 0)) return proven + length / 2;
  return proven + length * std::clamp(share, kLeastShare, 1 - kLeastShare);
}

}  // namespace

TurningSearch::TurningSearch(const MovingHull& a, const MovingHull& b, const MotionOptions& options)
    : a_(a), b_(b), options_(options), poll_(options.should_stop, 1), plane_(a, b) {
  const auto size_of = [](const MovingHull& moving) {
    return moving.hull.max_abs_coordinate() + (moving.radius + moving.piece_radius);
  };
  const double sizes = size_of(a) + size_of(b);
  resolution_ = std::max(options.resolution.value_or(kDefaultRelativeResolution * sizes),
                         kLeastRelativeResolution * plane_.size());
}

absl::StatusOr<FirstContact> TurningSearch::Run() {
  const absl::StatusOr<Relation> at_start = RelationAt(0);
  if (!at_start.ok()) return at_start.status();
  if (*at_start != Relation::kSeparated) return Contact(0);
  bool may_tolerate = true;
  for (;;) {
    if (poll_.Step()) return MotionStopped();
    const absl::StatusOr<Vector> n = DirectionAt(separated_);
    if (!n.ok()) return n.status();
    const std::optional<Step> step = FindStep(*n);
    if (!step) return ConcludeStuck();
    last_length_ = step->until - separated_;
    last_direction_ = *n;
    separated_ = step->until;
    if (options_.want_certificate) intervals_.push_back({separated_, *n, step->offset});
    if (separated_ == 1 || separated_ > options_.latest) {
      return WithoutContact(Relation::kSeparated);
    }
    // Contact is likely where the plane fails, and after it.
    const double latest = LatestContactTime();
    for (const double time : {step->failed, latest}) {
      if (step->failed > latest) break;
      const absl::StatusOr<Relation> relation = RelationAt(time);
      if (!relation.ok()) return relation.status();
      if (*relation != Relation::kSeparated) return Contact(time);
    }
    if (may_tolerate && step->gap_after <= resolution_) {
      // The gap along n may be less than the separation.
      const absl::StatusOr<bool> near = IsWithinResolution();
      if (!near.ok()) return near.status();
      if (!*near) continue;
      const absl::StatusOr<double> tolerable = TolerableUntil(*n);
      if (!tolerable.ok()) return tolerable.status();
      const absl::StatusOr<Relation> at_end = RelationAt(1);
      if (!at_end.ok()) return at_end.status();
      if (*tolerable == 1 && *at_end == Relation::kSeparated) {
        return WithoutContact(Relation::kWithinTolerance);
      }
      may_tolerate = false;
    }
  }
}

absl::StatusOr<Relation> TurningSearch::RelationAt(double time) const {
  const absl::StatusOr<Answer> answer =
      PairAt(a_, b_, time).Check(/*want_certificate=*/false, options_.should_stop);
  if (!answer.ok()) return answer.status();
  return answer->relation;
}

absl::StatusOr<bool> TurningSearch::IsWithinResolution() const {
  return PairAt(a_, b_, separated_).IsWithin(resolution_, options_.should_stop);
}

absl::StatusOr<Vector> TurningSearch::DirectionAt(double time) const {
  const PairAt at(a_, b_, time);
  const Vector first =
      last_direction_.isZero(0) ? Vector(-Vector(at.pair().CenterDifference())) : last_direction_;
  if (at.pair().usable() && first.isZero(0)) return Vector(Vector::UnitX());
  return NearestDirection(at.pair(), first, options_.should_stop);
}

// Returns a long interval for which the direction gives a plane, or none if there is no progress.
std::optional<TurningSearch::Step> TurningSearch::FindStep(const Vector& n) const {
  if (n.isZero(0)) return std::nullopt;
  const MovingPlane::Result start = plane_.Try(n, separated_, separated_);
  if (!start.proven) return std::nullopt;
  Step step{separated_, start.offset, start.gap, start.gap, 2};
  double failed_gap = 0;
  double trial = std::min(1.0, separated_ + kGrowth * last_length_);
  for (int i = 0; i < kMostTrials || step.until == separated_; ++i) {
    if (!(trial > step.until) || trial == step.failed) break;
    const MovingPlane::Result result = plane_.Try(n, separated_, trial);
    if (result.proven) {
      step.until = trial;
      step.offset = result.offset;
      step.gap_after = result.gap;
      if (trial == 1 || result.gap <= kLeftShare * start.gap) break;
    } else {
      step.failed = trial;
      failed_gap = result.gap;
    }
    trial = step.failed > 1 ? std::min(1.0, separated_ + kGrowth * (step.until - separated_))
                            : TrialBetween(step.until, step.gap_after, step.failed, failed_gap);
  }
  if (step.until == separated_) return std::nullopt;
  return step;
}

// Returns the latest time that is within max_time_error of separated_, or at least the next double.
double TurningSearch::LatestContactTime() const {
  double latest = std::min(1.0, separated_ + options_.max_time_error);
  const SumWithError width = TwoSum(latest, -separated_);
  const bool is_wider = width.sum > options_.max_time_error ||
                        (width.sum == options_.max_time_error && width.error > 0);
  if (is_wider) latest = std::nextafter(latest, 0.0);
  return latest > separated_ ? latest : std::nextafter(separated_, 2.0);
}

// Returns the time up to which the separation is proven to be at least -resolution_ from separated_
// on, usually the latest such time. `n`: the direction at separated_.
absl::StatusOr<double> TurningSearch::TolerableUntil(Vector n) {
  // Exceeds the rounding of the length of n.
  const double margin = -resolution_ / 2 * (1 - 0x1p-40);
  double time = separated_;
  double length = last_length_;
  while (time < 1) {
    if (poll_.Step()) return MotionStopped();
    double until = std::min(1.0, time + kGrowth * length);
    while (!plane_.Try(n, time, until, margin).proven) {
      if (until - time < kShortestStep) return time;
      until = time + (until - time) / 2;
    }
    length = until - time;
    time = until;
    const absl::StatusOr<Vector> nearest = DirectionAt(time);
    if (!nearest.ok()) return nearest.status();
    // The nearest direction is unreliable if the hulls meet; the previous one may then be better.
    if (!nearest->isZero(0) &&
        plane_.Try(*nearest, time, time).gap > plane_.Try(n, time, time).gap) {
      n = *nearest;
    }
  }
  return time;
}

// No plane can be proven from separated_ on: the gap is below rounding, if not the rotation.
absl::StatusOr<FirstContact> TurningSearch::ConcludeStuck() {
  const double latest = LatestContactTime();
  absl::StatusOr<Relation> relation = RelationAt(latest);
  if (!relation.ok()) return relation.status();
  if (*relation != Relation::kSeparated) return Contact(latest);
  const absl::StatusOr<bool> near = IsWithinResolution();
  if (!near.ok()) return near.status();
  if (*near) {
    // Floating point may find no direction at such a distance.
    const absl::StatusOr<Vector> n =
        ExactNearestUnit(PairAt(a_, b_, separated_).pair(), options_.should_stop);
    if (!n.ok()) return n.status();
    const absl::StatusOr<double> tolerable = TolerableUntil(*n);
    if (!tolerable.ok()) return tolerable.status();
    if (*tolerable == 1) return WithoutContact(Relation::kWithinTolerance);
    const absl::StatusOr<double> contact = FindLateContact(*tolerable);
    if (!contact.ok()) return contact.status();
    if (*contact <= 1) return Contact(*contact);
  }
  return absl::InvalidArgumentError(
      "no separation can be proven between the poses: a rotation nearly vanishes, or sizes are out "
      "of range; add a pose between them");
}

// Returns an early time of contact, or a time above 1 if none is found. The separation between
// separated_ and it is below rounding, and not proven. The hulls probably meet at `likely`.
absl::StatusOr<double> TurningSearch::FindLateContact(double likely) const {
  double apart = separated_;
  double contact = 2;
  for (double length = kShortestStep; contact > 1; length *= kGrowth) {
    const bool passes = apart < likely && separated_ + length > likely;
    const double time = passes ? likely : std::min(1.0, separated_ + length);
    const absl::StatusOr<Relation> relation = RelationAt(time);
    if (!relation.ok()) return relation.status();
    if (*relation != Relation::kSeparated) contact = time;
    if (contact > 1) apart = time;
    if (apart == 1) return contact;
  }
  while (contact - apart > options_.max_time_error) {
    const double time = apart + (contact - apart) / 2;
    if (!(time > apart && time < contact)) break;
    const absl::StatusOr<Relation> relation = RelationAt(time);
    if (!relation.ok()) return relation.status();
    (*relation == Relation::kSeparated ? apart : contact) = time;
  }
  return contact;
}

absl::StatusOr<FirstContact> TurningSearch::Contact(double time) {
  absl::StatusOr<Answer> answer =
      PairAt(a_, b_, time).Check(options_.want_certificate, options_.should_stop);
  if (!answer.ok()) return answer.status();
  FirstContact contact = WithoutContact(answer->relation);
  contact.contact_time = time;
  contact.certificate = std::move(answer->certificate);
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
