#include "server/collisions/placed/query_settings.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/base/status_macros.h"
#include "core/query/body/body_search.h"
#include "server/contract/errors.h"

namespace hulld::server {
namespace {

constexpr OptionNames kFieldNames = {
    .tolerance = "tolerance",
    .max_error = "wanted.max_error",
    .clearance = "wanted.clearance",
    .certificate = "wanted.certificate",
    .separation = "wanted.separation",
    .witness = "wanted.witness",
    .normal = "wanted.normal",
    .textbook = "METHOD_TEXTBOOK_SAT",
};

}  // namespace

absl::StatusOr<QueryOptions> MakeQueryOptions(v1::Method method, const v1::Wanted& wanted,
                                              double tolerance, const Limits& limits,
                                              const CallLifetime& lifetime) {
  const bool is_textbook = method == v1::METHOD_TEXTBOOK_SAT;
  if (method != v1::METHOD_UNSPECIFIED && method != v1::METHOD_CERTIFIED_SEARCH && !is_textbook) {
    return InvalidArgument("method is ", static_cast<int>(method),
                           "; use METHOD_CERTIFIED_SEARCH (the default) or METHOD_TEXTBOOK_SAT");
  }
  QueryOptions options;
  options.method = is_textbook ? Method::kTextbookSat : Method::kCertifiedSearch;
  options.want_axis = wanted.axis();
  options.want_analysis = wanted.analysis();
  options.want_certificate = wanted.certificate();
  options.want_separation = wanted.separation();
  options.want_witness = wanted.witness();
  options.want_normal = wanted.normal();
  if (wanted.has_max_error()) options.max_error = wanted.max_error();
  if (wanted.has_clearance()) options.clearance = wanted.clearance();
  options.tolerance = tolerance;
  HULLD_RETURN_IF_ERROR(ValidateOptions(options, kFieldNames));
  if (wanted.clearance() < 0) {
    return InvalidArgument("wanted.clearance is ", wanted.clearance(),
                           "; it must be a length of at least 0");
  }
  if (wanted.has_max_time_error() || wanted.has_resolution()) {
    const absl::Status valid = ValidateMotionOptions(MakeMotionOptions(wanted, options));
    if (!valid.ok()) return Prefixed("wanted.", valid);
  }
  options.max_textbook_axes = limits.max_textbook_axes;
  // A thread computes one query at a time, so a query may use the whole budget of a request.
  options.max_depth_bytes = limits.request_memory;
  options.max_piece_certificates = Config::kMaxPieceCertificates;
  options.should_stop = [&lifetime] { return lifetime.ShouldStop(); };
  return options;
}

absl::Status ValidateForBodies(const QueryOptions& options) {
  return ValidateBodyOptions(options, kFieldNames);
}

MotionOptions MakeMotionOptions(const v1::Wanted& wanted, const QueryOptions& options) {
  MotionOptions motion;
  if (wanted.has_max_time_error()) motion.max_time_error = wanted.max_time_error();
  if (wanted.has_resolution()) motion.resolution = wanted.resolution();
  motion.want_certificate = options.want_certificate;
  motion.max_piece_certificates = Config::kMaxPieceCertificates;
  motion.should_stop = options.should_stop;
  return motion;
}

absl::Status ValidateForMotions(const QueryOptions& options) {
  const std::pair<bool, const char*> excluded[] = {
      {options.method == Method::kTextbookSat, "METHOD_TEXTBOOK_SAT"},
      {options.tolerance > 0, "tolerance"},
      {options.want_axis, "wanted.axis"},
      {options.want_analysis, "wanted.analysis"},
      {options.want_separation, "wanted.separation"},
      {options.want_witness, "wanted.witness"},
      {options.want_normal, "wanted.normal"},
      {options.clearance.has_value(), "wanted.clearance"},
  };
  for (const auto& [is_set, name] : excluded) {
    if (!is_set) continue;
    return InvalidArgument(
        name,
        " cannot be combined with end_pose; query the first contact, then query again at its pose");
  }
  return absl::OkStatus();
}

bool IsQuickToRelate(const QueryHull& hull) {
  // **Observed**: exact contact of hulls with 10000 vertices takes 60 us
  // (tests/bench/results/query_relation_*.csv). The first few queries of an unprepared hull scan
  // all of its points.
  constexpr size_t kMaxPoints = 10000;
  return hull.point_count() <= kMaxPoints;
}

absl::Status NameLimit(const absl::Status& status, const QueryOptions& options) {
  if (status.code() != absl::StatusCode::kResourceExhausted) return status;
  if (IsDepthTooLarge(status)) return AtLimit(status, options.max_depth_bytes, "request-memory");
  if (options.method == Method::kTextbookSat) {
    return AtLimit(status, options.max_textbook_axes, "max-textbook-axes");
  }
  return WithReason(status, v1::ERROR_REASON_PROOF_TOO_LARGE,
                    {{"limit", uint64_t{Config::kMaxPieceCertificates}}});
}

absl::Status ProofTooLarge(uint64_t certificates, uint64_t limit) {
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat(
          "the certificates of ", certificates,
          " pairs of pieces and the bodies' other data exceed the limit of a reply, ", limit,
          " bytes; use bodies with fewer pieces, or do not request certificates")),
      v1::ERROR_REASON_PROOF_TOO_LARGE, {{"limit", limit}});
}

}  // namespace hulld::server
