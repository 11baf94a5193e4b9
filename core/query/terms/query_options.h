#ifndef HULLD_CORE_QUERY_TERMS_QUERY_OPTIONS_H_
#define HULLD_CORE_QUERY_TERMS_QUERY_OPTIONS_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>

namespace hulld {

// QueryOptions::max_error by default, relative to the largest absolute coordinates of the two
// hulls, each about its centre, and the separation.
inline constexpr double kDefaultRelativeMaxError = 1e-12;

enum class Method : uint8_t { kCertifiedSearch, kTextbookSat };

struct QueryOptions {
  Method method = Method::kCertifiedSearch;
  bool want_axis = false;
  bool want_analysis = false;
  bool want_certificate = false;
  bool want_separation = false;
  bool want_witness = false;
  // The largest bound of a wanted separation that will do, in the caller's length unit; absent:
  // kDefaultRelativeMaxError times the sizes of the hulls and the separation. Where a double cannot
  // hold the value so well, the bound is that of its rounding.
  std::optional<double> max_error;
  // Answer::within_clearance: separation <= this, exactly; always at infinity, never at -infinity.
  std::optional<double> clearance;
  // tau >= 0, length. 0: the relation is exact, always. Positive: it may be kWithinTolerance where
  // |separation| <= tau. Not with a wanted separation, witness, clearance or certificate, nor the
  // textbook: these need the relation (ValidateOptions).
  double tolerance = 0;
  // Textbook only: more candidate axes than this are refused.
  uint64_t max_textbook_axes = std::numeric_limits<uint64_t>::max();
  // Bodies only: more certificates of pieces than this are refused.
  uint64_t max_piece_certificates = std::numeric_limits<uint64_t>::max();
  // Polled inside long loops, possibly from several threads; true ends the query with CANCELLED.
  // May be empty.
  std::function<bool()> should_stop;
  // Textbook only: threads of the loop over axes.
  int threads = 1;

  // Whether an answer holds more than the relation and within_clearance.
  bool WantsDetails() const {
    // Every pair asks this, so it has no branches.
    return (want_axis | want_analysis | want_certificate | want_separation | want_witness) != 0;
  }
  // Whether an answer names vertices or facets by index, or depends on a hull's canonical snapshot
  // otherwise: then a version of a LiveHull will not do.
  bool WantsCanonical() const { return method == Method::kTextbookSat || WantsDetails(); }
  // Whether the search may stop as soon as it knows the relation, which is the cheapest question.
  // Nothing else decides this.
  bool WantsRelationOnly() const {
    return method == Method::kCertifiedSearch && !WantsDetails() && !clearance.has_value();
  }
};

// The names of the options in error messages, as the interface of the caller has them.
struct OptionNames {
  const char* tolerance = "tolerance";
  const char* max_error = "max_error";
  const char* clearance = "clearance";
  const char* certificate = "want_certificate";
  const char* separation = "want_separation";
  const char* witness = "want_witness";
  const char* textbook = "the textbook method";
};

// OK, or INVALID_ARGUMENT: a tolerance or max_error that is negative or NaN, a clearance that is
// NaN, or a tolerance > 0 beside what needs the exact relation.
absl::Status ValidateOptions(const QueryOptions& options, const OptionNames& names = {});

// Whether these want the relation alone and are such as ValidateOptions passes; false where that is
// not seen at once. Cost: a few comparisons, so that most pairs need no status.
inline bool IsValidRelationOnly(const QueryOptions& options) {
  // Nothing that needs the exact relation is wanted, so any tolerance of at least 0 will do.
  return options.tolerance >= 0 && !options.max_error.has_value() && options.WantsRelationOnly();
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_QUERY_OPTIONS_H_
