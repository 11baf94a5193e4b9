#ifndef HULLD_CLIENT_HULLCTL_PARTS_SPLIT_APPEND_H_
#define HULLD_CLIENT_HULLCTL_PARTS_SPLIT_APPEND_H_

#include <string>
#include <vector>

#include "client/formats/mesh_file.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Appends each part of the meshes to a hull of its own, ID/PART, adds missing parts to the body of
// the ID, and prints the results. create: creates missing hulls and the body. Changes nothing if a
// hull has the ID.
ExitCode AppendParts(const Invocation& run, const std::string& body_id,
                     const std::vector<std::string>& files, SplitBy split, bool create);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PARTS_SPLIT_APPEND_H_
