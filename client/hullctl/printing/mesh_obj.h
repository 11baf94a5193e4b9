#ifndef HULLD_CLIENT_HULLCTL_PRINTING_MESH_OBJ_H_
#define HULLD_CLIENT_HULLCTL_PRINTING_MESH_OBJ_H_

#include <ostream>
#include <string>

#include "client/client.h"

namespace hulld {

// Returns the origin of a simplified mesh and its proven error, as in ", simplified from 72
// vertices within 0.5"; empty for a hull itself.
std::string ErrorText(const HullMesh& mesh);

// Writes a hull as OBJ text: vertices in canonical order with the shortest digits that read back as
// the same doubles, and maximal facets. A hull of dimension 1 is an edge `l`, one of dimension 0 a
// point `p`; an empty hull has only the comment.
void WriteObj(const HullMesh& mesh, std::ostream& out);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PRINTING_MESH_OBJ_H_
