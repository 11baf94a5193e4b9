#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_QUERY_OPTIONS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_QUERY_OPTIONS_H_

#include <optional>

#include "client/hullctl/command_line/command.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// Requests beyond the relation, as options shared by several commands.
struct QueryDetails {
  v1::Wanted wanted;
  std::optional<double> tolerance;
  v1::Method method = v1::METHOD_UNSPECIFIED;
  // Checks each answer's certificate; implies a request for it.
  bool verify = false;

  // Overrides `wanted` and `tolerance` of a request.
  template <typename Request>
  void Apply(Request* request) const {
    request->mutable_wanted()->MergeFrom(wanted);
    if (tolerance.has_value()) request->set_tolerance(*tolerance);
  }
};

// Declares --axis, --report, --certificate, --separation, --max-error, --witness, --normal,
// --clearance, and --tolerance. `details` must outlive the parsing.
void AddWantedOptions(Command command, QueryDetails* details);

// Declares the same options plus --textbook and --verify.
void AddQueryOptions(Command command, QueryDetails* details);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_QUERY_OPTIONS_H_
