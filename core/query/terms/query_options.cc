#include "core/query/terms/query_options.h"

#include <absl/strings/cord.h>
#include <absl/strings/str_cat.h>

#include <cmath>

namespace hulld {
namespace {

absl::Status CheckLength(const char* name, double length) {
  if (length >= 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(name, " is ",
                                                 std::isnan(length) ? "NaN" : absl::StrCat(length),
                                                 "; it must be a length of at least 0"));
}

// Returns the name of an option that needs the exact relation, or null if none is set.
const char* ExactOption(const QueryOptions& options, const OptionNames& names) {
  return options.method == Method::kTextbookSat ? names.textbook
         : options.want_certificate             ? names.certificate
         : options.want_separation              ? names.separation
         : options.want_witness                 ? names.witness
         : options.want_normal                  ? names.normal
         : options.clearance.has_value()        ? names.clearance
                                                : nullptr;
}

// Payload of the error of DepthTooLarge.
constexpr char kDepthPayload[] = "hulld/depth-bytes";

}  // namespace

absl::Status DepthTooLarge(uint64_t max_depth_bytes) {
  absl::Status status = absl::ResourceExhaustedError(absl::StrCat(
      "the exact depth of this overlap needs more than ", max_depth_bytes,
      " bytes; request a max_error that floating point can meet, and no normal, or simplify "
      "the hulls"));
  status.SetPayload(kDepthPayload, absl::Cord());
  return status;
}

bool IsDepthTooLarge(const absl::Status& status) {
  return status.GetPayload(kDepthPayload).has_value();
}

absl::Status ValidateOptions(const QueryOptions& options, const OptionNames& names) {
  if (absl::Status s = CheckLength(names.tolerance, options.tolerance); !s.ok()) return s;
  if (absl::Status s = CheckLength(names.max_error, options.max_error.value_or(0)); !s.ok()) {
    return s;
  }
  if (std::isnan(options.clearance.value_or(0))) {
    return absl::InvalidArgumentError(absl::StrCat(names.clearance, " is NaN"));
  }
  if (options.tolerance == 0) return absl::OkStatus();
  const char* const exact = ExactOption(options, names);
  if (exact == nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(names.tolerance, " is ", options.tolerance,
                                                 ", but ", exact,
                                                 " needs the exact relation; omit one of them"));
}

}  // namespace hulld
