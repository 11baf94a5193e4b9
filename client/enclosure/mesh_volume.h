#ifndef HULLD_CLIENT_ENCLOSURE_MESH_VOLUME_H_
#define HULLD_CLIENT_ENCLOSURE_MESH_VOLUME_H_

#include <optional>

#include "client/client.h"
#include "client/formats/mesh_file.h"

namespace hulld {

// Whether the triangles close a volume: each edge is passed as often in one direction as in the
// other. Vertices at the same coordinates count as one, as files such as STL repeat them. Cost:
// n log n.
bool IsClosed(const TriangleMesh& mesh);

// How much larger the hull is than the mesh: its volume over that of the mesh, each summed exactly
// (signed tetrahedra, Gauss 1813), the quotient rounded. Parts of the mesh that overlap count
// twice; its direction does not matter. Nothing when the mesh is not closed, or has no volume: then
// there is none to compare. Requires facets of the hull that are planar, as the server's are.
// Cost: exact arithmetic for each triangle.
std::optional<double> VolumeRatio(const HullMesh& hull, const TriangleMesh& mesh);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_MESH_VOLUME_H_
