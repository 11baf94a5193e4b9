#ifndef HULLD_CLIENT_HULLCTL_PARTS_SPLIT_APPEND_H_
#define HULLD_CLIENT_HULLCTL_PARTS_SPLIT_APPEND_H_

#include <string>
#include <vector>

#include "client/formats/mesh_file.h"
#include "client/hullctl/command_line/invocation.h"

namespace hulld {

// Adds each part of the meshes to a hull of its own, ID/PART, and prints what became of it.
// create: makes hulls that are not there.
ExitCode AppendParts(const Invocation& run, const std::string& hull_id,
                     const std::vector<std::string>& files, SplitBy split, bool create);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PARTS_SPLIT_APPEND_H_
