#ifndef HULLD_TESTS_CASES_CASES_H_
#define HULLD_TESTS_CASES_CASES_H_

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "hulld/v1/collision.pb.h"

namespace hulld {

// An input with the structure of one that another program was reported to get wrong, and its exact
// answer, which follows from the construction.
struct Case {
  // As on the page: "owner/repository#number".
  std::string report;
  // Points, n x 3, of A and B.
  std::vector<double> a;
  std::vector<double> b;
  v1::Relation relation;
  // The double nearest to the exact separation, and the distance to it; NaN if it has no closed
  // form.
  double separation;
  double rounding = 0;
  // Quaternion of both, w x y z, not normalized.
  std::array<double, 4> rotation = {1, 0, 0, 0};
  // Vertices of the hull of A; 0: not compared.
  size_t vertices = 0;
};

std::vector<Case> ReportedCases();

}  // namespace hulld

#endif  // HULLD_TESTS_CASES_CASES_H_
