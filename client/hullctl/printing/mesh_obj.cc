#include "client/hullctl/printing/mesh_obj.h"

#include "client/formats/text_number.h"

namespace hulld {

std::string ErrorText(const HullMesh& mesh) {
  if (!mesh.header.has_error()) return "";
  return ", simplified from " + std::to_string(mesh.header.hull().vertex_count()) +
         " vertices within " + ShortestText(mesh.header.error());
}

void WriteObj(const HullMesh& mesh, std::ostream& out) {
  const v1::HullInfo& hull = mesh.header.hull();
  out << "# hull " << hull.hull_id() << " revision " << hull.revision() << ": dimension "
      << hull.dimension() << ", " << mesh.vertex_count() << " vertices, " << mesh.facet_sizes.size()
      << " facets" << ErrorText(mesh) << "\n";
  for (size_t i = 0; i < mesh.xyz.size(); i += 3) {
    out << "v " << ShortestText(mesh.xyz[i]) << " " << ShortestText(mesh.xyz[i + 1]) << " "
        << ShortestText(mesh.xyz[i + 2]) << "\n";
  }
  if (mesh.facet_sizes.empty()) {
    if (mesh.vertex_count() == 1) out << "p 1\n";
    if (mesh.vertex_count() == 2) out << "l 1 2\n";
  }
  size_t next = 0;
  for (const uint32_t size : mesh.facet_sizes) {
    out << "f";
    // OBJ counts from 1.
    for (const size_t end = next + size; next < end; ++next) {
      out << " " << uint64_t{mesh.facet_indices[next]} + 1;
    }
    out << "\n";
  }
}

}  // namespace hulld
