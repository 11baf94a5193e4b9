#include "core/query/collision.h"

#include <absl/status/status.h>

#include <algorithm>
#include <chrono>
#include <compare>
#include <utility>

#include "core/query/axis_description.h"
#include "core/query/exact_pair.h"
#include "core/query/exact_search.h"
#include "core/query/float_pair.h"
#include "core/query/float_search.h"
#include "core/query/textbook_sat.h"

namespace hulld {
namespace {

// One hull at one pose.
struct Placed {
  const Hull& hull;
  const Pose& pose;
};

// A total order of placed hulls by their content, so that a pair is answered the same way whichever
// of the two comes first.
std::weak_ordering Compare(const Placed& a, const Placed& b) {
  const auto compare = [](const auto& x, const auto& y) {
    return std::lexicographical_compare_three_way(x.begin(), x.end(), y.begin(), y.end(),
                                                  [](double p, double q) {
                                                    return p < q   ? std::weak_ordering::less
                                                           : q < p ? std::weak_ordering::greater
                                                                   : std::weak_ordering::equivalent;
                                                  });
  };
  if (const auto order = compare(a.pose.t, b.pose.t); order != 0) return order;
  if (const auto order = compare(a.pose.q, b.pose.q); order != 0) return order;
  const auto va = a.hull.vertices();
  const auto vb = b.hull.vertices();
  if (const auto order = va.size() <=> vb.size(); order != 0) return order;
  for (size_t i = 0; i < va.size(); ++i) {
    if (const auto order = compare(va[i], vb[i]); order != 0) return order;
  }
  return std::weak_ordering::equivalent;
}

AxisKind Mirrored(AxisKind kind) {
  if (kind == AxisKind::kFacetA) return AxisKind::kFacetB;
  if (kind == AxisKind::kFacetB) return AxisKind::kFacetA;
  return kind;
}

// The answer for (B, A) from that for (A, B).
Answer Mirrored(Answer answer) {
  if (answer.analysis.stage) answer.analysis.stage = Mirrored(*answer.analysis.stage);
  if (answer.axis) {
    answer.axis->direction = -answer.axis->direction;
    answer.axis->kind = Mirrored(answer.axis->kind);
    std::swap(answer.axis->feature_a, answer.axis->feature_b);
  }
  return answer;
}

IntegerVector ToIntegers(const Vector& n) {
  constexpr int kAboveAllExponents = 1024;
  return ToInteger(n, LowestBitExponent(n, kAboveAllExponents));
}

bool MustDescribe(const QueryOptions& options) { return options.want_axis || options.want_stage; }

void Describe(ExactPair& pair, const IntegerVector& n, const QueryOptions& options,
              Answer& answer) {
  SeparatingAxis axis = DescribeAxis(pair, n);
  answer.analysis.stage = axis.kind;
  if (options.want_axis) answer.axis = std::move(axis);
}

// The ladder: floating point with a proven bound, then exact arithmetic.
absl::StatusOr<Answer> CertifiedSearch(const Placed& a, const Placed& b,
                                       const QueryOptions& options) {
  const FloatPair filter(a.hull, a.pose, b.hull, b.pose);
  Answer answer;
  if (filter.usable()) {
    const FloatSearchResult found = SearchInFloatingPoint(filter);
    answer.analysis.axes_tested = found.directions_tried;
    answer.rung = Rung::kFloatingPoint;
    if (found.portal.verdict == PortalVerdict::kOverlapping) {
      answer.relation = Relation::kOverlapping;
      return answer;
    }
    if (found.portal.verdict == PortalVerdict::kSeparated) {
      answer.relation = Relation::kSeparated;
      if (MustDescribe(options)) {
        ExactPair exact(a.hull, a.pose, b.hull, b.pose, filter);
        Describe(exact, ToIntegers(*found.portal.axis), options, answer);
      }
      return answer;
    }
  }
  ExactPair exact(a.hull, a.pose, b.hull, b.pose, filter);
  absl::StatusOr<ExactSearchResult> found = SearchExactly(exact, options.should_stop);
  if (!found.ok()) return found.status();
  answer.rung = Rung::kExact;
  answer.relation = found->relation;
  answer.analysis.axes_tested += found->directions_tried;
  if (found->axis && MustDescribe(options)) Describe(exact, *found->axis, options, answer);
  return answer;
}

absl::StatusOr<Answer> CertifiedSearchOfEither(const Placed& a, const Placed& b,
                                               const QueryOptions& options) {
  if (Compare(a, b) <= 0) return CertifiedSearch(a, b, options);
  absl::StatusOr<Answer> answer = CertifiedSearch(b, a, options);
  if (!answer.ok()) return answer;
  return Mirrored(*std::move(answer));
}

}  // namespace

absl::StatusOr<Answer> CheckCollision(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, const QueryOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (absl::Status status = ValidatePose(X_WA); !status.ok()) return status;
  if (absl::Status status = ValidatePose(X_WB); !status.ok()) return status;
  absl::StatusOr<Answer> answer = Answer{};
  if (!a.empty() && !b.empty()) {
    answer = options.method == Method::kTextbookSat
                 ? TextbookSat(a, X_WA, b, X_WB, options)
                 : CertifiedSearchOfEither({a, X_WA}, {b, X_WB}, options);
  }
  if (answer.ok()) answer->analysis.time = std::chrono::steady_clock::now() - start;
  return answer;
}

}  // namespace hulld
