#ifndef HULLD_CORE_QUERY_TERMS_ANALYSIS_H_
#define HULLD_CORE_QUERY_TERMS_ANALYSIS_H_

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/query/terms/axis.h"

namespace hulld {

// The textbook's report, as far as the search has one, too.
struct Analysis {
  std::chrono::nanoseconds time{0};
  // Textbook: up to and including the reported axis, counted as if serial, or all. Search:
  // directions tried.
  uint64_t axes_tested = 0;
  // Textbook: candidates in all, parallel edge pairs included. Otherwise 0.
  uint64_t axes_total = 0;
  // Where separation, or when touching the first zero gap, was found: the kind of the axis.
  std::optional<AxisKind> stage;
  std::optional<uint64_t> axis_index;  // textbook: the index of that axis, from 0
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_ANALYSIS_H_
