#ifndef HULLD_CLIENT_FORMATS_DAE_DAE_MESH_H_
#define HULLD_CLIENT_FORMATS_DAE_DAE_MESH_H_

#include <array>
#include <pugixml.hpp>

#include "client/formats/dae/dae_document.h"
#include "client/formats/length_scale.h"
#include "client/formats/mesh_file.h"

namespace hulld {

// Reads a <geometry>: the triangles of its primitives and all positions of its <vertices>, used by
// primitives or not, multiplied by the scale of x, y, and z and rounded once. Polygons and their
// holes become fans; lines have no triangles. Errors are stored in the document: the geometry is
// not a <mesh>, an index is out of range, or a count does not match its elements.
TriangleMesh ReadDaeMesh(pugi::xml_node geometry, const std::array<LengthScale, 3>& scale,
                         DaeDocument* document);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_DAE_DAE_MESH_H_
