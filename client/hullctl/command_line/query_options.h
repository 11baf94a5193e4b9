#ifndef HULLD_CLIENT_HULLCTL_COMMAND_LINE_QUERY_OPTIONS_H_
#define HULLD_CLIENT_HULLCTL_COMMAND_LINE_QUERY_OPTIONS_H_

#include <optional>

#include "client/hullctl/command_line/command.h"
#include "hulld/v1/collision.pb.h"

namespace hulld {

// What a command asks for beyond the relation, as options that several commands share.
struct QueryWishes {
  v1::Wanted wanted;
  std::optional<double> tolerance;
  v1::Method method = v1::METHOD_UNSPECIFIED;
  // Check each answer's certificate; it is wanted then.
  bool verify = false;

  // Puts them over what a file wishes.
  void Apply(v1::Wanted* file_wanted, double* file_tolerance) const;
};

// Declares --axis, --report, --certificate, --separation, --max-error, --witness, --clearance and
// --tolerance. `wishes` must outlive the parsing.
void AddWantedOptions(Command command, QueryWishes* wishes);

// The same with --textbook and --verify.
void AddQueryOptions(Command command, QueryWishes* wishes);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_COMMAND_LINE_QUERY_OPTIONS_H_
