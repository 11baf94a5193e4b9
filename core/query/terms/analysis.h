#ifndef HULLD_CORE_QUERY_TERMS_ANALYSIS_H_
#define HULLD_CORE_QUERY_TERMS_ANALYSIS_H_

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/query/terms/axis.h"

namespace hulld {

// A report in the form of the textbook method; the search fills the applicable fields.
struct Analysis {
  std::chrono::nanoseconds time{0};
  // Textbook: number of axes up to and including the reported one, counted as if serial, or all.
  // Search: directions tried.
  uint64_t axes_tested = 0;
  // Textbook: number of candidates, parallel edge pairs included. Otherwise 0.
  uint64_t axes_total = 0;
  // Kind of the axis that showed the separation or, if touching, the first zero gap.
  std::optional<AxisKind> stage;
  std::optional<uint64_t> axis_index;  // textbook: the index of that axis, from 0
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_ANALYSIS_H_
