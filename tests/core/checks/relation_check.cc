#include "tests/core/checks/relation_check.h"

#include <string>

#include "tests/core/checks/axis_check.h"
#include "tests/core/checks/certificate_bridge.h"
#include "tests/core/checks/oracle_bridge.h"

namespace hulld {
namespace {

// Returns the fault of a textbook report, or empty.
std::string AnalysisFault(const Hull& a, const Hull& b, const Answer& answer) {
  if (!answer.analysis) return "no analysis";
  const Analysis& analysis = *answer.analysis;
  if (analysis.axes_tested > analysis.axes_total) return "more axes tested than there are";
  if (a.dimension() == 3 && b.dimension() == 3) {
    const uint64_t expected =
        a.facet_count() + b.facet_count() + a.edges().size() * b.edges().size();
    if (analysis.axes_total != expected) return "axes_total is not F + F + E E";
  }
  const bool has_axis = answer.relation != Relation::kOverlapping && !a.empty() && !b.empty();
  if (has_axis != analysis.stage.has_value())
    return "stage is set without an axis, or missing with one";
  if (has_axis != analysis.axis_index.has_value())
    return "axis_index is set without an axis, or missing with one";
  if (!has_axis) {
    if (!a.empty() && !b.empty() && analysis.axes_tested != analysis.axes_total) {
      return "overlapping without a test of every axis";
    }
    return "";
  }
  if (*analysis.axis_index >= analysis.axes_total) return "axis_index out of range";
  if (answer.axis && answer.axis->kind != *analysis.stage) return "stage is not the axis's kind";
  if (answer.relation == Relation::kSeparated && analysis.axes_tested != *analysis.axis_index + 1) {
    return "axes_tested is not up to and including the reported axis";
  }
  return "";
}

}  // namespace

testing::AssertionResult RelationCheck::Verify(const Hull& a, const Pose& X_WA, const Hull& b,
                                               const Pose& X_WB, Relation expected, Ways ways) {
  ++queries_;
  ++relations_[static_cast<size_t>(expected)];
  for (Method method : {Method::kCertifiedSearch, Method::kTextbookSat}) {
    if (method == Method::kTextbookSat && ways == kSearchOnly) continue;
    testing::AssertionResult result = VerifyOnce(a, X_WA, b, X_WB, expected, method);
    if (!result) return result;
    result = VerifyOnce(b, X_WB, a, X_WA, expected, method);
    if (!result) return result << " (with the hulls swapped)";
  }
  return testing::AssertionSuccess();
}

testing::AssertionResult RelationCheck::VerifyOnce(const Hull& a, const Pose& X_WA, const Hull& b,
                                                   const Pose& X_WB, Relation expected,
                                                   Method method) {
  const bool textbook = method == Method::kTextbookSat;
  const auto failure = [&] {
    return testing::AssertionFailure()
           << Describe(a, X_WA, b, X_WB) << (textbook ? "textbook SAT: " : "certified search: ");
  };
  QueryOptions options;
  options.method = method;
  options.want_axis = true;
  options.want_analysis = textbook;
  options.want_certificate = !textbook;
  const absl::StatusOr<Answer> answer = CheckCollision(a, X_WA, b, X_WB, options);
  if (!answer.ok()) return failure() << answer.status();
  if (answer->relation != expected) {
    return failure() << Name(answer->relation) << ", expected " << Name(expected);
  }
  const testing::AssertionResult axis = AxisIsValid(a, X_WA, b, X_WB, *answer);
  if (!axis) return failure() << axis.message();
  if (!textbook) {
    const absl::StatusOr<Answer> plain = CheckCollision(a, X_WA, b, X_WB);
    if (!plain.ok()) return failure() << plain.status();
    if (plain->relation != expected) {
      return failure() << Name(plain->relation) << " if only the relation is requested, expected "
                       << Name(expected);
    }
    const testing::AssertionResult certificate = CertificateIsValid(a, X_WA, b, X_WB, *answer);
    if (!certificate) return failure() << certificate.message();
  }
  if (textbook) {
    const std::string fault = AnalysisFault(a, b, *answer);
    if (!fault.empty()) return failure() << Name(expected) << ": " << fault;
    if (answer->axis) ++textbook_kinds_[static_cast<size_t>(answer->axis->kind)];
  } else {
    ++rungs_[static_cast<size_t>(answer->rung)];
    if (answer->axis) ++kinds_[static_cast<size_t>(answer->axis->kind)];
  }
  return testing::AssertionSuccess();
}

}  // namespace hulld
