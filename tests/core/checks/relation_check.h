#ifndef HULLD_TESTS_CORE_CHECKS_RELATION_CHECK_H_
#define HULLD_TESTS_CORE_CHECKS_RELATION_CHECK_H_

#include <gtest/gtest.h>

#include <array>

#include "core/query/collision.h"

namespace hulld {

// Queries core in all ways and counts the regimes reached, so that a sweep can assert that it
// reached all of them.
class RelationCheck {
 public:
  enum Ways {
    kAllWays,
    kSearchOnly,  // for hulls with too many axes for the textbook
  };

  // True if core returns `expected` for (A, B) and (B, A) by both methods, each with a valid axis
  // and a consistent analysis, the search with a valid certificate, and also by a search for the
  // relation alone.
  testing::AssertionResult Verify(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB,
                                  Relation expected, Ways ways = kAllWays);

  int queries() const { return queries_; }
  // Returns the number of queries with this relation.
  int count(Relation relation) const { return relations_[static_cast<size_t>(relation)]; }
  // Return the number of answers of the default method from this rung, or with this kind of axis.
  int count(Rung rung) const { return rungs_[static_cast<size_t>(rung)]; }
  int count(AxisKind kind) const { return kinds_[static_cast<size_t>(kind)]; }
  // Returns the number of textbook answers with this kind of axis.
  int textbook_count(AxisKind kind) const { return textbook_kinds_[static_cast<size_t>(kind)]; }

 private:
  testing::AssertionResult VerifyOnce(const Hull& a, const Pose& X_WA, const Hull& b,
                                      const Pose& X_WB, Relation expected, Method method);

  int queries_ = 0;
  std::array<int, 4> relations_ = {};
  std::array<int, kRungCount> rungs_ = {};
  std::array<int, 5> kinds_ = {};
  std::array<int, 5> textbook_kinds_ = {};
};

}  // namespace hulld

#endif  // HULLD_TESTS_CORE_CHECKS_RELATION_CHECK_H_
