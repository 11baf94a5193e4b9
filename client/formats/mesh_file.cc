#include "client/formats/mesh_file.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <limits>
#include <map>

#include "client/base/status_macros.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

constexpr size_t kMaxVertices = std::numeric_limits<uint32_t>::max();

absl::Status AddVertex(const ByteSource& source, std::string_view text, TriangleMesh* mesh) {
  std::array<double, 3> p;
  for (double& coordinate : p) {
    const std::string_view token = NextToken(&text);
    if (token.empty()) return source.ErrorAtLine("a vertex needs 3 coordinates");
    const NumberText kind = ParseCoordinate(token, &coordinate);
    if (kind != NumberText::kNumber) return source.ErrorAtLine(NumberProblem(kind, token));
    if (!std::isfinite(coordinate)) {
      return source.ErrorAtLine(Quoted(token) + " is not finite");
    }
  }
  if (mesh->vertices.size() >= kMaxVertices) return source.ErrorAtLine("too many vertices");
  mesh->vertices.push_back(p);
  return absl::OkStatus();
}

// Returns the triangles of a mesh in parts. part_of: the part of each triangle.
std::vector<MeshPart> Distribute(const TriangleMesh& mesh, const std::vector<uint32_t>& part_of,
                                 const std::vector<std::string>& names) {
  constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  std::vector<MeshPart> parts;
  parts.reserve(names.size());
  for (const std::string& name : names) parts.push_back({name, {}});
  std::vector<std::vector<uint32_t>> triangles_of(parts.size());
  for (uint32_t i = 0; i < mesh.triangles.size(); ++i) triangles_of[part_of[i]].push_back(i);
  std::vector<uint32_t> index(mesh.vertices.size(), kNone);
  for (size_t part = 0; part < parts.size(); ++part) {
    TriangleMesh& to = parts[part].mesh;
    for (const uint32_t i : triangles_of[part]) {
      std::array<uint32_t, 3> triangle = mesh.triangles[i];
      for (uint32_t& corner : triangle) {
        uint32_t& known = index[corner];
        if (known == kNone) {
          known = static_cast<uint32_t>(to.vertices.size());
          to.vertices.push_back(mesh.vertices[corner]);
        }
        corner = known;
      }
      to.triangles.push_back(triangle);
    }
    for (const uint32_t i : triangles_of[part]) {
      for (const uint32_t corner : mesh.triangles[i]) index[corner] = kNone;
    }
  }
  std::erase_if(parts, [](const MeshPart& part) { return part.mesh.triangles.empty(); });
  return parts;
}

// Returns the connected components of a mesh.
std::vector<MeshPart> Components(const TriangleMesh& mesh) {
  // Each vertex points to another one of its component, and eventually to the component's
  // representative.
  std::vector<uint32_t> leader(mesh.vertices.size());
  std::map<std::array<double, 3>, uint32_t> first;
  for (uint32_t i = 0; i < leader.size(); ++i) {
    const std::array<double, 3>& p = mesh.vertices[i];
    // Adding 0 turns -0 into 0.
    leader[i] = first.emplace(std::array{p[0] + 0, p[1] + 0, p[2] + 0}, i).first->second;
  }
  const auto find = [&leader](uint32_t i) {
    while (leader[i] != i) i = leader[i] = leader[leader[i]];
    return i;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    leader[find(a)] = find(b);
    leader[find(b)] = find(c);
  }
  std::map<uint32_t, uint32_t> number;
  std::vector<uint32_t> part_of;
  std::vector<std::string> names;
  for (const auto& triangle : mesh.triangles) {
    const auto [entry, is_new] =
        number.emplace(find(triangle[0]), static_cast<uint32_t>(names.size()));
    if (is_new) names.push_back(absl::StrCat("component-", names.size() + 1));
    part_of.push_back(entry->second);
  }
  return Distribute(mesh, part_of, names);
}

}  // namespace

void AddPolygon(const std::vector<uint32_t>& corners, TriangleMesh* mesh) {
  for (size_t i = 2; i < corners.size(); ++i) {
    mesh->triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

absl::Status AddMesh(const std::string& file, const TriangleMesh& part, TriangleMesh* to) {
  const size_t first = to->vertices.size();
  if (first + part.vertices.size() > kMaxVertices) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": too many vertices"));
  }
  to->vertices.insert(to->vertices.end(), part.vertices.begin(), part.vertices.end());
  const auto offset = static_cast<uint32_t>(first);
  for (const auto& [a, b, c] : part.triangles) {
    to->triangles.push_back({a + offset, b + offset, c + offset});
  }
  return absl::OkStatus();
}

absl::Status ReadObjMesh(ByteSource* source, TriangleMesh* mesh) {
  ObjReceiver receiver;
  receiver.vertex = [&](std::string_view text) { return AddVertex(*source, text, mesh); };
  receiver.face = [mesh](const std::vector<uint32_t>& corners) { AddPolygon(corners, mesh); };
  return WalkObj(source, receiver);
}

absl::Status ReadObjParts(ByteSource* source, std::vector<MeshPart>* parts) {
  TriangleMesh mesh;
  std::vector<uint32_t> part_of;
  std::vector<std::string> names;
  std::map<std::string, uint32_t> number;
  std::string object;
  std::string group;
  ObjReceiver receiver;
  receiver.vertex = [&](std::string_view text) { return AddVertex(*source, text, &mesh); };
  receiver.face = [&](const std::vector<uint32_t>& corners) {
    const std::string name =
        absl::StrCat(object, object.empty() || group.empty() ? "" : ".", group);
    const auto [entry, is_new] = number.emplace(name, static_cast<uint32_t>(names.size()));
    if (is_new) names.push_back(name);
    AddPolygon(corners, &mesh);
    part_of.resize(mesh.triangles.size(), entry->second);
  };
  receiver.name = [&](std::string_view keyword, std::string_view name) {
    if (keyword == "o") object = name;
    // A new object starts without a group.
    group = keyword == "g" ? std::string(name) : "";
  };
  HULLD_RETURN_IF_ERROR(WalkObj(source, receiver));
  *parts = Distribute(mesh, part_of, names);
  return absl::OkStatus();
}

absl::Status ReadStlParts(ByteSource* source, std::vector<MeshPart>* parts) {
  std::map<std::string, size_t> number;
  size_t present = 0;
  StlReceiver receiver;
  receiver.solid = [&](std::string_view name) {
    const auto [entry, is_new] = number.emplace(name, parts->size());
    if (is_new) parts->push_back({std::string(name), {}});
    present = entry->second;
  };
  receiver.parse = [](std::string_view text, size_t, double* value) {
    return ParseCoordinate(text, value);
  };
  receiver.corner = [&](const std::array<double, 3>& p, const StlErrorAt& error_at) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
      return error_at("a coordinate is not finite");
    }
    TriangleMesh& mesh = (*parts)[present].mesh;
    if (mesh.vertices.size() >= kMaxVertices) return error_at("too many vertices");
    mesh.vertices.push_back(p);
    const auto size = static_cast<uint32_t>(mesh.vertices.size());
    if (size % 3 == 0) mesh.triangles.push_back({size - 3, size - 2, size - 1});
    return absl::OkStatus();
  };
  receiver.float_corner = [&](const std::array<float, 3>& p, const StlErrorAt& error_at) {
    return receiver.corner({p[0], p[1], p[2]}, error_at);
  };
  return WalkStl(source, receiver);
}

namespace {

// Reads the parts of a format that names them.
absl::Status ReadNamedParts(const std::string& path, PointFormat format,
                            std::vector<MeshPart>* parts) {
  HULLD_ASSIGN_OR_RETURN(auto source, ByteSource::Open(path));
  HULLD_RETURN_IF_ERROR(source->CheckStart());
  switch (format) {
    case PointFormat::kObj:
      return ReadObjParts(source.get(), parts);
    case PointFormat::kStl:
      return ReadStlParts(source.get(), parts);
    case PointFormat::kGltf:
      return ReadGltfParts(source.get(), parts);
    default:
      return ReadDaeParts(source.get(), parts);
  }
}

}  // namespace

absl::StatusOr<std::vector<MeshPart>> ReadParts(const std::string& path, SplitBy split) {
  HULLD_ASSIGN_OR_RETURN(const PointFormat format, PointFormatOfPath(path));
  std::vector<MeshPart> parts;
  const bool has_names =
      IsMeshFormat(format) && format != PointFormat::kOff && format != PointFormat::kPly;
  if (split == SplitBy::kComponent || !has_names) {
    HULLD_ASSIGN_OR_RETURN(const auto mesh, ReadMesh(path));
    if (split == SplitBy::kComponent) {
      parts = Components(mesh);
    } else if (!mesh.triangles.empty()) {
      parts.push_back({"", mesh});
    }
  } else if (absl::Status read = ReadNamedParts(path, format, &parts); !read.ok()) {
    return read;
  }
  std::erase_if(parts, [](const MeshPart& part) { return part.mesh.triangles.empty(); });
  if (!parts.empty()) return parts;
  return absl::InvalidArgumentError(absl::StrCat(path, ": contains no triangles"));
}

absl::Status ReadOffMesh(ByteSource* source, TriangleMesh* mesh) {
  OffReader reader(source);
  HULLD_RETURN_IF_ERROR(reader.ReadHeader());
  std::string_view content;
  for (uint64_t i = 0; i < reader.vertex_count(); ++i) {
    HULLD_RETURN_IF_ERROR(reader.NextVertex(i, &content));
    HULLD_RETURN_IF_ERROR(AddVertex(*source, content, mesh));
  }
  std::vector<uint32_t> corners;
  for (uint64_t i = 0; i < reader.face_count(); ++i) {
    HULLD_RETURN_IF_ERROR(reader.NextFace(i, &corners));
    AddPolygon(corners, mesh);
  }
  return reader.Finish();
}

absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path) {
  HULLD_ASSIGN_OR_RETURN(const PointFormat format, PointFormatOfPath(path));
  HULLD_ASSIGN_OR_RETURN(auto source, ByteSource::Open(path));
  HULLD_RETURN_IF_ERROR(source->CheckStart());
  TriangleMesh mesh;
  switch (format) {
    case PointFormat::kObj:
      HULLD_RETURN_IF_ERROR(ReadObjMesh(source.get(), &mesh));
      break;
    case PointFormat::kOff:
      HULLD_RETURN_IF_ERROR(ReadOffMesh(source.get(), &mesh));
      break;
    case PointFormat::kPly:
      HULLD_RETURN_IF_ERROR(ReadPlyMesh(source.get(), &mesh));
      break;
    case PointFormat::kStl:
    case PointFormat::kGltf:
    case PointFormat::kDae: {
      std::vector<MeshPart> parts;
      HULLD_RETURN_IF_ERROR(ReadNamedParts(path, format, &parts));
      for (const MeshPart& part : parts) HULLD_RETURN_IF_ERROR(AddMesh(path, part.mesh, &mesh));
      break;
    }
    default:
      return absl::InvalidArgumentError(absl::StrCat(
          path, ": meshes are read from obj, off, ply, stl, gltf and dae; convert the file"));
  }
  return mesh;
}

}  // namespace hulld
