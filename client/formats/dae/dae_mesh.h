#ifndef HULLD_CLIENT_FORMATS_DAE_DAE_MESH_H_
#define HULLD_CLIENT_FORMATS_DAE_DAE_MESH_H_

#include <array>
#include <pugixml.hpp>

#include "client/formats/dae/dae_document.h"
#include "client/formats/length_scale.h"
#include "client/formats/mesh_file.h"

namespace hulld {

// Reads a <geometry>: all positions of its <vertices>, whether primitives use them or not, times
// the scale of x, y, and z, rounded once, and the triangles of its primitives. Polygons and their
// holes become fans; lines have no triangles. Errors are kept in the document: it is not a <mesh>;
// indices without vertices; counts that are not those of the elements.
TriangleMesh ReadDaeMesh(pugi::xml_node geometry, const std::array<LengthScale, 3>& scale,
                         DaeDocument* document);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_DAE_DAE_MESH_H_
