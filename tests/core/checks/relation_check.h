#ifndef HULLD_TESTS_CORE_CHECKS_RELATION_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_RELATION_CHECK_H_

#include <gtest/gtest.h>

#include <array>

#include "core/query/collision.h"

namespace hulld {

// Asks core one question in all ways and counts which regimes the questions reached, so that a
// sweep can assert that it reached them all.
class RelationCheck {
 public:
  enum Ways {
    kAllWays,
    kSearchOnly,  // for hulls too large for the textbook's number of axes
  };

  // Whether core says `expected` for A and B and for B and A, by both methods, each with a valid
  // axis and a consistent analysis, and the search with a certificate that proves it; and the
  // search also when asked for nothing else.
  testing::AssertionResult Ask(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
                               Relation expected, Ways ways = kAllWays);

  int questions() const { return questions_; }
  // How many questions had this relation.
  int count(Relation relation) const { return relations_[static_cast<size_t>(relation)]; }
  // How many answers of the default method came from this rung, or by an axis of this kind.
  int count(Rung rung) const { return rungs_[static_cast<size_t>(rung)]; }
  int count(AxisKind kind) const { return kinds_[static_cast<size_t>(kind)]; }
  // How many answers of the textbook method had an axis of this kind.
  int textbook_count(AxisKind kind) const { return textbook_kinds_[static_cast<size_t>(kind)]; }

 private:
  testing::AssertionResult AskOnce(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
                                   Relation expected, Method method);

  int questions_ = 0;
  std::array<int, 4> relations_ = {};
  std::array<int, kRungCount> rungs_ = {};
  std::array<int, 5> kinds_ = {};
  std::array<int, 5> textbook_kinds_ = {};
};

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_RELATION_CHECK_H_
