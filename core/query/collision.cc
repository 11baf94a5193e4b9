#include "core/query/collision.h"

#include <absl/status/status.h>

#include <algorithm>
#include <chrono>
#include <compare>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/exponent_limits.h"
#include "core/query/axis_description.h"
#include "core/query/certification.h"
#include "core/query/exact/exact_pair.h"
#include "core/query/floating/float_distance.h"
#include "core/query/floating/float_pair.h"
#include "core/query/floating/float_search.h"
#include "core/query/ladder.h"
#include "core/query/rounded.h"
#include "core/query/separation.h"
#include "core/query/terms/separation_bounds.h"
#include "core/query/textbook_sat.h"

namespace hulld {
namespace {

std::weak_ordering Compare(std::span<const double> a, std::span<const double> b) {
  return std::lexicographical_compare_three_way(a.begin(), a.end(), b.begin(), b.end(),
                                                [](double x, double y) {
                                                  return x < y   ? std::weak_ordering::less
                                                         : y < x ? std::weak_ordering::greater
                                                                 : std::weak_ordering::equivalent;
                                                });
}

std::span<const double> Coordinates(const Vector& v) { return {v.data(), 3}; }

std::weak_ordering Compare(const Pose& a, const Pose& b) {
  if (const auto order = Compare(Coordinates(a.t), Coordinates(b.t)); order != 0) return order;
  return Compare(a.q, b.q);
}

// Orders two products of poses; null comes first.
std::weak_ordering Compare(const PoseProduct* a, const PoseProduct* b) {
  if (a == nullptr || b == nullptr) return (a != nullptr) <=> (b != nullptr);
  if (const auto order = Compare(a->X_WB(), b->X_WB()); order != 0) return order;
  return Compare(a->X_BP(), b->X_BP());
}

// A total order of placed hulls by content, so that both orders of a pair yield the same answer.
[[gnu::noinline]] std::weak_ordering Compare(const PlacedHull& a, const PlacedHull& b) {
  if (const auto order = Compare(a.X_WH(), b.X_WH()); order != 0) return order;
  if (const auto order = Compare(a.product(), b.product()); order != 0) return order;
  if (const auto order = Compare(a.radii(), b.radii()); order != 0) return order;
  const QueryHull& hull_a = a.query_hull();
  const QueryHull& hull_b = b.query_hull();
  if (const auto order = hull_a.point_count() <=> hull_b.point_count(); order != 0) return order;
  for (uint32_t i = 0; i < hull_a.point_count(); ++i) {
    const Vector p_a = hull_a.point(i);
    const Vector p_b = hull_b.point(i);
    if (const auto order = Compare(Coordinates(p_a), Coordinates(p_b)); order != 0) return order;
  }
  return std::weak_ordering::equivalent;
}

// Two hulls in the order of Compare. The first coordinate usually decides. The order is
// unpredictable, so it selects the hulls without a branch.
class OrderedPair {
 public:
  OrderedPair(const PlacedHull& a, const PlacedHull& b) : hulls_{&a, &b} {
    const double x_a = a.X_WH().t.x();
    const double x_b = b.X_WH().t.x();
    swapped_ = x_a == x_b ? Compare(a, b) > 0 : x_a > x_b;
  }
  const PlacedHull& first() const { return *hulls_[swapped_]; }
  const PlacedHull& second() const { return *hulls_[1 - swapped_]; }
  bool swapped() const { return swapped_ != 0; }

 private:
  const PlacedHull* hulls_[2];
  size_t swapped_;
};

bool IsRounded(const PlacedHull& a, const PlacedHull& b) {
  return a.is_rounded() || b.is_rounded();
}

// OK, or INVALID_ARGUMENT if the textbook method is requested for rounded hulls.
absl::Status ValidateRadii(const PlacedHull& a, const PlacedHull& b, const QueryOptions& options) {
  if (options.method != Method::kTextbookSat || !IsRounded(a, b)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "the textbook method applies to hulls without a radius; omit one of them");
}

AxisKind Mirrored(AxisKind kind) {
  if (kind == AxisKind::kFacetA) return AxisKind::kFacetB;
  if (kind == AxisKind::kFacetB) return AxisKind::kFacetA;
  return kind;
}

// Converts the answer for (A, B) to the answer for (B, A).
void Mirror(Answer& answer) {
  if (answer.analysis && answer.analysis->stage) {
    answer.analysis->stage = Mirrored(*answer.analysis->stage);
  }
  if (answer.axis) {
    answer.axis->direction = -answer.axis->direction;
    answer.axis->kind = Mirrored(answer.axis->kind);
    std::swap(answer.axis->feature_a, answer.axis->feature_b);
  }
  if (answer.witness) std::swap(answer.witness->p_WA, answer.witness->p_WB);
  // 0 stays +0.
  if (answer.normal) answer.normal->direction = Vector::Zero() - answer.normal->direction;
  if (answer.certificate) answer.certificate = Mirrored(*std::move(answer.certificate));
}

bool WantsSeparation(const QueryOptions& options) {
  return options.want_separation || options.want_witness || options.want_normal ||
         options.clearance.has_value();
}

// Returns true if the answer needs more than the relation, the axis and the analysis.
bool NeedsMore(const QueryOptions& options) {
  return options.want_certificate || WantsSeparation(options);
}

SeparationRequest RequestOf(const QueryOptions& options) {
  return {options.want_separation, options.want_witness, options.want_normal,
          options.max_error,       options.clearance,    options.max_depth_bytes};
}

// Adds the requested details of the separation. `decision`: the decision for the cores.
absl::Status AddSeparation(const FloatPair& pair, const Decision& decision, bool cold,
                           const QueryOptions& options, Answer& answer) {
  if (!WantsSeparation(options)) return absl::OkStatus();
  SeparationAnswer found;
  if (absl::Status s = FindSeparation(pair, decision, answer.relation, cold, RequestOf(options),
                                      options.should_stop, found);
      !s.ok()) {
    return s;
  }
  answer.separation = found.separation;
  if (found.witness) answer.witness = *found.witness;
  if (found.normal) answer.normal = *found.normal;
  answer.within_clearance = found.within_clearance;
  return absl::OkStatus();
}

// Adds the requested details beyond the relation, the axis and the analysis.
absl::Status AddRequestedDetails(const FloatPair& pair, const Decision& decision, bool cold,
                                 const QueryOptions& options, Answer& answer) {
  if (options.want_certificate) {
    ExactPair exact(pair, options.should_stop);
    absl::StatusOr<Certificate> certificate = MakeCertificate(exact, decision, options.should_stop);
    if (!certificate.ok()) return certificate.status();
    answer.certificate = *std::move(certificate);
  }
  return AddSeparation(pair, decision, cold, options, answer);
}

// Adds the description of the axis, and its kind to the analysis.
absl::Status AddAxis(const FloatPair& pair, const ExactDirection& direction,
                     uint64_t directions_tried, const QueryOptions& options, Answer& answer) {
  if (options.want_analysis) {
    answer.analysis = Analysis();
    answer.analysis->axes_tested = directions_tried;
  }
  const std::optional<IntegerVector> n = ExactAxis(direction);
  if (!n) return absl::OkStatus();
  ExactPair exact(pair, options.should_stop);
  SeparatingAxis axis = DescribeAxis(exact, *n);
  if (exact.stopped()) return absl::CancelledError("the query was cancelled");
  if (options.want_analysis) answer.analysis->stage = axis.kind;
  if (options.want_axis) answer.axis = std::move(axis);
  return absl::OkStatus();
}

// Requires: A and B in the order of their content.
absl::StatusOr<Answer> CertifiedSearch(const PlacedHull& a, const PlacedHull& b,
                                       const QueryOptions& options, PairCache* cache) {
  const FloatPair pair(a, b);
  Decision decision;
  if (absl::Status s = Decide(pair, options.tolerance, cache, Purpose::kEvidence,
                              SearchErrorFor(RequestOf(options)), options.should_stop, decision);
      !s.ok()) {
    return s;
  }
  Answer answer;
  answer.relation = decision.relation;
  answer.rung = decision.rung;
  if (options.want_axis || options.want_analysis) {
    absl::Status s = AddAxis(pair, decision.axis, decision.directions_tried, options, answer);
    if (!s.ok()) return s;
  }
  if (NeedsMore(options)) {
    absl::Status s = AddRequestedDetails(pair, decision, cache == nullptr, options, answer);
    if (!s.ok()) return s;
  }
  return answer;
}

// Adds the axis, the analysis, and the certificate of rounded hulls. The axis is the direction of
// the certificate.
absl::Status AddRoundedEvidence(const FloatPair& pair, uint64_t directions_tried,
                                const QueryOptions& options, Answer& answer) {
  Certificate certificate;
  const bool has_axis =
      answer.relation == Relation::kSeparated || answer.relation == Relation::kTouching;
  if (has_axis || options.want_certificate) {
    SeparationBounds bounds;
    if (pair.usable()) {
      SeparationGoal goal;
      goal.relative_error = kDefaultRelativeMaxError;
      bounds = BoundDistance(pair, -pair.CenterDifference(), {}, goal);
    }
    ExactPair exact(pair, options.should_stop);
    absl::StatusOr<Certificate> made = MakeRoundedCertificate(
        exact, answer.relation, TowardOrigin(pair, bounds),
        std::span(bounds.point.pairs).first(bounds.point.count), options.should_stop);
    if (!made.ok()) return made.status();
    certificate = *std::move(made);
  }
  if (options.want_axis || options.want_analysis) {
    absl::Status s = AddAxis(pair, certificate.direction, directions_tried, options, answer);
    if (!s.ok()) return s;
  }
  if (options.want_certificate) answer.certificate = std::move(certificate);
  return absl::OkStatus();
}

// CertifiedSearch for rounded hulls, at least one of which has a radius. Requires: as
// CertifiedSearch.
absl::StatusOr<Answer> SearchRounded(const PlacedHull& a, const PlacedHull& b,
                                     const QueryOptions& options, PairCache* cache) {
  const FloatPair pair(a, b);
  Decision decision;
  absl::Status decided =
      DecideRounded(pair, options.tolerance, cache, options.should_stop, decision);
  if (!decided.ok()) return decided;
  Answer answer;
  answer.relation = decision.relation;
  answer.rung = decision.rung;
  if (options.want_axis || options.want_analysis || options.want_certificate) {
    absl::Status s = AddRoundedEvidence(pair, decision.directions_tried, options, answer);
    if (!s.ok()) return s;
  }
  if (!WantsSeparation(options)) return answer;
  Decision of_cores;
  absl::Status s = Decide(pair, 0, nullptr, Purpose::kEvidence, SearchErrorFor(RequestOf(options)),
                          options.should_stop, of_cores);
  if (s.ok()) s = AddSeparation(pair, of_cores, /*cold=*/true, options, answer);
  if (!s.ok()) return s;
  return answer;
}

// Converts the cache for (A, B) to the cache for (B, A).
void Mirror(PairCache& cache) {
  if (cache.axis) cache.axis = -*cache.axis;
  if (cache.touching) cache.touching->Mirror();
  for (uint32_t i = 0; i < cache.pair_count; ++i) std::swap(cache.pairs[i].a, cache.pairs[i].b);
}

// Answers queries for the relation alone, the most common kind.
absl::StatusOr<Answer> RelationOnly(const PlacedHull& a, const PlacedHull& b,
                                    const QueryOptions& options, PairCache* cache) {
  // The relation is symmetric; only the cache depends on the order.
  const OrderedPair ordered(a, b);
  if (cache != nullptr && ordered.swapped()) Mirror(*cache);
  Decision decision;
  const absl::Status decided =
      Decide(FloatPair(ordered.first(), ordered.second()), options.tolerance, cache,
             Purpose::kRelation, kEndsAtSign, options.should_stop, decision);
  if (cache != nullptr && ordered.swapped()) Mirror(*cache);
  // Every return statement names this variable, so that the compiler constructs it in the caller's
  // storage.
  absl::StatusOr<Answer> answer(absl::in_place);
  if (decided.ok()) {
    answer->relation = decision.relation;
    answer->rung = decision.rung;
  } else {
    answer = decided;
  }
  return answer;
}

absl::StatusOr<Answer> CertifiedSearchOfEither(const PlacedHull& a, const PlacedHull& b,
                                               const QueryOptions& options, PairCache* cache) {
  const auto search = IsRounded(a, b) ? SearchRounded : CertifiedSearch;
  const OrderedPair ordered(a, b);
  if (cache != nullptr && ordered.swapped()) Mirror(*cache);
  absl::StatusOr<Answer> answer = search(ordered.first(), ordered.second(), options, cache);
  if (cache != nullptr && ordered.swapped()) Mirror(*cache);
  if (ordered.swapped() && answer.ok()) Mirror(*answer);
  return answer;
}

// Completes the textbook's answer with the details that only the search finds.
absl::StatusOr<Answer> WithSearchDetails(Answer answer, const PlacedHull& a, const PlacedHull& b,
                                         const QueryOptions& options) {
  if (!NeedsMore(options)) return answer;
  QueryOptions rest = options;
  rest.want_axis = false;
  rest.want_analysis = false;
  absl::StatusOr<Answer> more = CertifiedSearchOfEither(a, b, rest, nullptr);
  if (!more.ok()) return more;
  more->rung = answer.rung;
  more->axis = std::move(answer.axis);
  more->analysis = std::move(answer.analysis);
  return more;
}

absl::StatusOr<Answer> Textbook(const PlacedHull& a, const PlacedHull& b,
                                const QueryOptions& options) {
  absl::StatusOr<Answer> answer = TextbookSat(a, b, options);
  if (!answer.ok()) return answer;
  return WithSearchDetails(*std::move(answer), a, b, options);
}

Answer AnswerOfEmpty(const QueryOptions& options) {
  Answer answer;
  if (options.want_analysis) answer.analysis = Analysis();
  if (options.want_separation) {
    answer.separation = Separation{std::numeric_limits<double>::infinity(), 0};
  }
  if (options.clearance) answer.within_clearance = false;
  return answer;
}

// CheckCollision for every kind of query. Not inlined, to keep the common path short.
[[gnu::noinline]] absl::StatusOr<Answer> AnswerAny(const PlacedHull& a, const PlacedHull& b,
                                                   const QueryOptions& options, PairCache* cache) {
  if (absl::Status status = ValidateOptions(options); !status.ok()) return status;
  if (absl::Status status = ValidateRadii(a, b, options); !status.ok()) return status;
  if (a.empty() || b.empty()) return AnswerOfEmpty(options);
  if (options.WantsRelationOnly() && !IsRounded(a, b)) return RelationOnly(a, b, options, cache);
  HULLD_CHECK(!options.WantsCanonical() ||
              (a.query_hull().canonical() != nullptr && b.query_hull().canonical() != nullptr));
  std::optional<std::chrono::steady_clock::time_point> start;
  if (options.want_analysis) start = std::chrono::steady_clock::now();
  absl::StatusOr<Answer> answer = options.method == Method::kTextbookSat
                                      ? Textbook(a, b, options)
                                      : CertifiedSearchOfEither(a, b, options, cache);
  if (answer.ok() && start) answer->analysis->time = std::chrono::steady_clock::now() - *start;
  return answer;
}

}  // namespace

absl::StatusOr<TextbookCheck> TextbookCheck::Begin(const PlacedHull& a, const PlacedHull& b,
                                                   const QueryOptions& options) {
  HULLD_CHECK(options.method == Method::kTextbookSat);
  if (absl::Status status = ValidateOptions(options); !status.ok()) return status;
  if (absl::Status status = ValidateRadii(a, b, options); !status.ok()) return status;
  TextbookCheck check(a, b, options);
  if (a.empty() || b.empty()) return check;
  const auto start = TextbookSearch::Clock::now();
  absl::StatusOr<TextbookSearch> search = TextbookSearch::Begin(a, b, options);
  if (!search.ok()) return search.status();
  check.search_ = *std::move(search);
  check.time_ = TextbookSearch::Clock::now() - start;
  return check;
}

absl::StatusOr<bool> TextbookCheck::Advance(std::chrono::steady_clock::time_point end) {
  if (!search_.has_value()) return true;
  const auto start = TextbookSearch::Clock::now();
  const absl::StatusOr<bool> done = search_->Advance(end);
  time_ += TextbookSearch::Clock::now() - start;
  return done;
}

absl::StatusOr<Answer> TextbookCheck::Finish() {
  if (!search_.has_value()) return AnswerOfEmpty(*options_);
  const auto start = TextbookSearch::Clock::now();
  absl::StatusOr<Answer> answer = search_->Finish();
  if (answer.ok()) answer = WithSearchDetails(*std::move(answer), *a_, *b_, *options_);
  time_ += TextbookSearch::Clock::now() - start;
  if (answer.ok() && options_->want_analysis) answer->analysis->time = time_;
  return answer;
}

absl::StatusOr<Answer> CheckCollision(const PlacedHull& a, const PlacedHull& b,
                                      const QueryOptions& options, PairCache* cache) {
  if (IsValidRelationOnly(options) && !a.empty() && !b.empty() && !IsRounded(a, b)) {
    return RelationOnly(a, b, options, cache);
  }
  return AnswerAny(a, b, options, cache);
}

absl::StatusOr<Answer> CheckCollision(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, const QueryOptions& options) {
  const QueryHull query_a(a);
  const QueryHull query_b(b);
  const absl::StatusOr<PlacedHull> placed_a = PlacedHull::Make(query_a, X_WA);
  if (!placed_a.ok()) return placed_a.status();
  const absl::StatusOr<PlacedHull> placed_b = PlacedHull::Make(query_b, X_WB);
  if (!placed_b.ok()) return placed_b.status();
  return CheckCollision(*placed_a, *placed_b, options);
}

}  // namespace hulld
