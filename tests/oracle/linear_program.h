#ifndef HULLD_TESTS_ORACLE_LINEAR_PROGRAM_H_
#define HULLD_TESTS_ORACLE_LINEAR_PROGRAM_H_

#include <vector>

#include "tests/oracle/exact_integers.h"

namespace hulld::oracle {

// Returns true if weights w >= 0 exist with sum(w[j] * columns[j]) == rhs, exactly. Uses phase one
// of the revised simplex method with Bland's rule (Bland 1977), which is finite, and keeps the
// basis inverse as integers over a common determinant (Edmonds 1967), which avoids fractions.
// columns: each as long as rhs. Cost: O(columns) per pivot.
bool HasNonnegativeSolution(const std::vector<std::vector<Integer>>& columns,
                            std::vector<Integer> rhs);

}  // namespace hulld::oracle

#endif  // HULLD_TESTS_ORACLE_LINEAR_PROGRAM_H_
