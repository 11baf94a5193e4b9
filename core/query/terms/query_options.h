#ifndef HULLD_CORE_QUERY_TERMS_QUERY_OPTIONS_H_
#define HULLD_CORE_QUERY_TERMS_QUERY_OPTIONS_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>

namespace hulld {

// Default of QueryOptions::max_error, relative to the separation and the largest absolute
// coordinates of the two hulls, each about its center.
inline constexpr double kDefaultRelativeMaxError = 1e-12;

// The largest bound on the angle of a normal, in radians. Floating point meets it inside facets,
// and for hulls about as far apart as they are large; otherwise exact arithmetic finds the normal.
inline constexpr double kMaxNormalAngle = 1e-6;

enum class Method : uint8_t { kCertifiedSearch, kTextbookSat };

struct QueryOptions {
  Method method = Method::kCertifiedSearch;
  bool want_axis = false;
  bool want_analysis = false;
  bool want_certificate = false;
  bool want_separation = false;
  bool want_witness = false;
  bool want_normal = false;
  // The largest acceptable bound on a requested separation, in the caller's length unit. Defaults
  // to kDefaultRelativeMaxError times the sizes of the hulls and the separation. If a double cannot
  // represent the value that accurately, the bound is its rounding error.
  std::optional<double> max_error;
  // Requests Answer::within_clearance: separation <= clearance, exactly. Always true for infinity,
  // never for -infinity.
  std::optional<double> clearance;
  // tau >= 0, in the caller's length unit. If 0, the relation is always exact. If positive, the
  // relation may be kWithinTolerance if |separation| <= tau. Cannot be combined with a requested
  // separation, witness, normal, clearance or certificate, or with the textbook method, which need
  // the exact relation (ValidateOptions).
  double tolerance = 0;
  // Textbook only: maximum number of candidate axes; more are refused.
  uint64_t max_textbook_axes = std::numeric_limits<uint64_t>::max();
  // Maximum memory of the exact search for a depth, in bytes; more is refused. A search may need
  // about 10 KB for each vertex near the deepest contact, as in a disc pierced at its center.
  uint64_t max_depth_bytes = std::numeric_limits<uint64_t>::max();
  // Bodies only: maximum number of certificates of pieces; more are refused.
  uint64_t max_piece_certificates = std::numeric_limits<uint64_t>::max();
  // Polled in long loops, possibly from several threads; true ends the query with CANCELLED. May be
  // empty.
  std::function<bool()> should_stop;
  // Textbook only: threads of the loop over axes.
  int threads = 1;

  // True if an answer contains more than the relation and within_clearance.
  bool WantsDetails() const {
    // Branch-free, because every pair evaluates it.
    return (want_axis | want_analysis | want_certificate | want_separation | want_witness |
            want_normal) != 0;
  }
  // True if an answer names vertices or facets by index, or depends on a hull's canonical snapshot
  // in another way. A version of a LiveHull is then not sufficient.
  bool WantsCanonical() const { return method == Method::kTextbookSat || WantsDetails(); }
  // True if the search may stop as soon as it knows the relation, the cheapest kind of query. No
  // other code decides this.
  bool WantsRelationOnly() const {
    return method == Method::kCertifiedSearch && !WantsDetails() && !clearance.has_value();
  }
};

// Returns the RESOURCE_EXHAUSTED error of a query that exceeds QueryOptions::max_depth_bytes.
absl::Status DepthTooLarge(uint64_t max_depth_bytes);
// Returns true for that error.
bool IsDepthTooLarge(const absl::Status& status);

// Option names for error messages, as spelled in the caller's interface.
struct OptionNames {
  const char* tolerance = "tolerance";
  const char* max_error = "max_error";
  const char* clearance = "clearance";
  const char* certificate = "want_certificate";
  const char* separation = "want_separation";
  const char* witness = "want_witness";
  const char* normal = "want_normal";
  const char* textbook = "the textbook method";
};

// Returns OK, or INVALID_ARGUMENT for a tolerance or max_error that is negative or NaN, a clearance
// that is NaN, or a tolerance > 0 combined with an option that needs the exact relation.
absl::Status ValidateOptions(const QueryOptions& options, const OptionNames& names = {});

// Returns true if the options request the relation alone and pass ValidateOptions. May return false
// for valid options. Cost: a few comparisons, so that most pairs need no status.
inline bool IsValidRelationOnly(const QueryOptions& options) {
  // No requested detail needs the exact relation, so any tolerance of at least 0 is valid.
  return options.tolerance >= 0 && !options.max_error.has_value() && options.WantsRelationOnly();
}

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_TERMS_QUERY_OPTIONS_H_
