#ifndef HULLD_CLIENT_ENCLOSURE_MESH_VOLUME_H_
#define HULLD_CLIENT_ENCLOSURE_MESH_VOLUME_H_

#include <optional>

#include "client/client.h"
#include "client/formats/mesh_file.h"

namespace hulld {

// Returns true if the triangles enclose a volume: each edge is traversed equally often in both
// directions. Vertices at the same coordinates count as one because formats such as STL repeat
// them. Cost: n log n.
bool IsClosed(const TriangleMesh& mesh);

// Returns the volume of the hull divided by the volume of the mesh. Each is summed exactly (signed
// tetrahedra, Gauss 1813), and the quotient is rounded. Overlapping parts of the mesh count twice;
// its orientation does not matter. Nullopt if the mesh is not closed or has no volume. Requires
// planar facets of the hull, as returned by the server. Cost: exact arithmetic for each triangle.
std::optional<double> VolumeRatio(const HullMesh& hull, const TriangleMesh& mesh);

}  // namespace hulld

#endif  // HULLD_CLIENT_ENCLOSURE_MESH_VOLUME_H_
