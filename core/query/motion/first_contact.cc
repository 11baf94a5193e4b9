#include "core/query/motion/first_contact.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <variant>

#include "core/numeric/exponent_limits.h"
#include "core/query/motion/pair_at.h"
#include "core/query/motion/translation_search.h"
#include "core/query/motion/turning_search.h"
#include "core/query/terms/answer.h"

namespace hulld {
namespace {

std::array<double, 23> ValuesOf(const MovingHull& moving) {
  std::array<double, 23> values = {moving.radius, moving.piece_radius};
  auto next = values.begin() + 2;
  for (const Pose* pose : {&moving.X_WB.start, &moving.X_WB.end, &moving.X_BH}) {
    next = std::copy(pose->q.begin(), pose->q.end(), next);
    next = std::copy(pose->t.begin(), pose->t.end(), next);
  }
  return values;
}

// Returns true if (A, B) is in a total order by content, so that both orders of a pair yield the
// same answer.
bool IsInOrder(const MovingHull& a, const MovingHull& b) {
  const auto values_a = ValuesOf(a);
  const auto values_b = ValuesOf(b);
  if (values_a != values_b) return values_a < values_b;
  if (a.hull.point_count() != b.hull.point_count()) {
    return a.hull.point_count() < b.hull.point_count();
  }
  for (uint32_t i = 0; i < a.hull.point_count(); ++i) {
    const Vector p_a = a.hull.point(i);
    const Vector p_b = b.hull.point(i);
    if (p_a != p_b) {
      return std::lexicographical_compare(p_a.begin(), p_a.end(), p_b.begin(), p_b.end());
    }
  }
  return true;
}

// Converts the answer for (A, B) to the answer for (B, A).
FirstContact Mirrored(FirstContact contact) {
  for (SeparatedInterval& interval : contact.intervals) {
    if (Vector* n = std::get_if<Vector>(&interval.direction)) *n = -*n;
    if (IntegerVector* n = std::get_if<IntegerVector>(&interval.direction)) *n = -*n;
    if (interval.offset) interval.offset = -*interval.offset;
    if (interval.end) interval.end = {{-interval.end->direction, -interval.end->offset}};
  }
  if (contact.certificate) contact.certificate = Mirrored(*std::move(contact.certificate));
  return contact;
}

absl::Status ValidateMoving(const char* name, const MovingHull& moving) {
  absl::Status status = ValidateMotion(moving.X_WB);
  if (status.ok()) status = ValidatePose(moving.X_BH);
  if (!status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", status.message()));
  }
  for (const double radius : {moving.radius, moving.piece_radius}) {
    if (!(radius >= 0 && radius <= kLargestDouble)) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, ": radius is ", radius, "; it must be finite and at least 0"));
    }
  }
  return absl::OkStatus();
}

bool KeepsItsPose(const Motion& motion) {
  return motion.start.t == motion.end.t && IsTranslation(motion);
}

// Finds the contact of two hulls at rest, whose relation is the same at all times.
absl::StatusOr<FirstContact> FindAtRest(const MovingHull& a, const MovingHull& b,
                                        const MotionOptions& options) {
  absl::StatusOr<Answer> answer =
      PairAt(a, b, 0).Check(options.want_certificate, options.should_stop);
  if (!answer.ok()) return answer.status();
  FirstContact contact;
  contact.relation = answer->relation;
  if (answer->relation != Relation::kSeparated) {
    contact.separated_until = 0;
    contact.contact_time = 0;
    contact.certificate = std::move(answer->certificate);
  } else if (options.want_certificate) {
    SeparatedInterval& interval = contact.intervals.emplace_back();
    const ExactDirection& direction = answer->certificate->direction;
    if (const Vector* n = std::get_if<Vector>(&direction)) interval.direction = *n;
    if (const IntegerVector* n = std::get_if<IntegerVector>(&direction)) interval.direction = *n;
  }
  return contact;
}

// Requires: valid arguments, neither hull empty, and IsInOrder(a, b).
absl::StatusOr<FirstContact> FindInOrder(const MovingHull& a, const MovingHull& b,
                                         const MotionOptions& options) {
  // With radii, the time of a translation is irrational in general.
  const bool rounded = a.is_rounded() || b.is_rounded();
  if (!rounded && IsTranslation(a.X_WB) && IsTranslation(b.X_WB)) {
    return TranslationSearch(a, b, options).Run();
  }
  if (KeepsItsPose(a.X_WB) && KeepsItsPose(b.X_WB)) return FindAtRest(a, b, options);
  return TurningSearch(a, b, options).Run();
}

}  // namespace

absl::Status ValidateMotionOptions(const MotionOptions& options) {
  if (!(options.max_time_error > 0 && options.max_time_error <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_time_error is ", options.max_time_error, "; it must be in (0, 1]"));
  }
  if (options.resolution && !(*options.resolution >= 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("resolution is ", *options.resolution, "; it must be at least 0"));
  }
  return absl::OkStatus();
}

absl::StatusOr<FirstContact> FindFirstContact(const MovingHull& a, const MovingHull& b,
                                              const MotionOptions& options) {
  if (absl::Status s = ValidateMotionOptions(options); !s.ok()) return s;
  if (absl::Status s = ValidateMoving("a", a); !s.ok()) return s;
  if (absl::Status s = ValidateMoving("b", b); !s.ok()) return s;
  if (a.hull.empty() || b.hull.empty()) return FirstContact();
  if (IsInOrder(a, b)) return FindInOrder(a, b, options);
  absl::StatusOr<FirstContact> contact = FindInOrder(b, a, options);
  if (contact.ok()) contact = Mirrored(*std::move(contact));
  return contact;
}

}  // namespace hulld
