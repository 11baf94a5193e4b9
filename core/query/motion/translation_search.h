#ifndef HULLD_CORE_QUERY_MOTION_TRANSLATION_SEARCH_H_
#define HULLD_CORE_QUERY_MOTION_TRANSLATION_SEARCH_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/base/stop_poll.h"
#include "core/numeric/integer.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/motion/first_contact.h"
#include "core/query/motion/pair_at.h"
#include "core/query/terms/certificate.h"
#include "core/query/terms/relation.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Finds the first contact of two translations, exactly. With d the displacement of B relative to A,
// the pair is in contact at t if t d is in C, which is A - B at t = 0. A direction n with n.w < 0
// for all w of C - t d separates the pair at t; if n.d < 0, also at all times before the plane
// reaches the origin, at a rational time; otherwise at all times after t.
//
// A cast in floating point usually proves a plane that separates the pair throughout, or ends at
// the triangle of C that the origin enters. Double-double arithmetic proves the entry between two
// doubles; if that fails, or a certificate is requested, one exact test of the triangle gives the
// time. Otherwise, directions come from exact queries at doubles. These close in on the first
// contact from both sides: each moves either the time before which the pair is separated, or the
// earliest time known to be in contact or after it, until the two are adjacent doubles. If a
// contact lies between adjacent doubles and no query at a double shows it, one exact query of the
// swept pair finds it.
class TranslationSearch {
 public:
  // All arguments must outlive the search. Requires: neither hull is empty, and both motions are
  // valid translations.
  TranslationSearch(const MovingHull& a, const MovingHull& b, const MotionOptions& options)
      : a_(a), b_(b), options_(options), poll_(options.should_stop, 1), start_(a, b, 0) {}

  // CANCELLED: should_stop returned true.
  absl::StatusOr<FirstContact> Run();

 private:
  using Direction = std::variant<Vector, IntegerVector>;
  // The pair at time 1/2.
  struct Middle {
    Middle(const MovingHull& a, const MovingHull& b, const std::function<bool()>& should_stop);

    PairAt at;
    ExactPair pair;
    // Half the displacement of B relative to A, in the units of `pair`.
    IntegerVector half;
  };
  // Evidence about upper_.
  enum class Upper { kUnknown, kContact, kSeparatedAfter };

  void Cast();
  void TakeEntry(double before, double after, Relation relation);
  absl::Status TryFacet();
  absl::Status Narrow();
  absl::Status RaiseToNearest();
  double NextTime() const;
  absl::Status QueryAt(double time);
  absl::Status TakeSeparating(double time, Direction direction);
  void TakeSeparatedFrom(double time, Direction direction);
  absl::StatusOr<FirstContact> Conclude();
  FirstContact Separated();
  absl::Status AddCertificate(FirstContact& contact);
  Middle& middle();

  const MovingHull& a_;
  const MovingHull& b_;
  const MotionOptions& options_;
  StopPoll poll_;
  // The pair at time 0.
  const PairAt start_;
  // Built on demand.
  std::optional<Middle> middle_;
  // The triangle at which the cast ended.
  std::optional<std::array<VertexPair, 3>> facet_;
  // If requested, the proof of the contact at upper_ from this triangle.
  std::optional<Certificate> proof_;

  // The pair is separated at all times before lower_, as the intervals prove, and at lower_ itself
  // if lower_excluded_.
  double lower_ = 0;
  bool lower_excluded_ = false;
  std::vector<SeparatedInterval> intervals_;
  // kContact: the pair is in contact at upper_. kSeparatedAfter: after_ separates it at upper_ and
  // all later times.
  double upper_ = 1;
  Upper upper_state_ = Upper::kUnknown;
  std::optional<Direction> after_;
  // The relation at upper_, if kContact.
  Relation relation_ = Relation::kSeparated;
  // Number of doubles from lower_ to the next query, and how often it may still be reset to 1.
  int64_t stride_ = 1;
  int restarts_left_ = 16;
  // True if the direction in which the pair is nearest at lower_ is known or has been tried.
  bool raised_ = false;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_MOTION_TRANSLATION_SEARCH_H_
