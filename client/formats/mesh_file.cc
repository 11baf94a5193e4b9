#include "client/formats/mesh_file.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <limits>

#include "client/formats/obj_face.h"
#include "client/formats/off_reader.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

constexpr size_t kMaxVertices = std::numeric_limits<uint32_t>::max();

absl::Status AddVertex(const ByteSource& source, std::string_view text, TriangleMesh* mesh) {
  std::array<double, 3> p;
  for (double& coordinate : p) {
    const std::string_view token = NextToken(&text);
    const NumberText kind = ParseDouble(token, &coordinate);
    if (kind != NumberText::kNumber) return source.ErrorAtLine(NumberProblem(kind, token));
    if (!std::isfinite(coordinate)) {
      return source.ErrorAtLine(Quoted(token) + " cannot be drawn; a vertex must be finite");
    }
  }
  if (mesh->vertices.size() >= kMaxVertices) return source.ErrorAtLine("too many vertices");
  mesh->vertices.push_back(p);
  return absl::OkStatus();
}

// Adds the polygon as a fan from its first corner.
void AddPolygon(const std::vector<uint32_t>& corners, TriangleMesh* mesh) {
  for (size_t i = 2; i < corners.size(); ++i) {
    mesh->triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

// The index among the vertices so far.
bool FindObjVertex(std::string_view token, size_t vertices, uint32_t* index) {
  int64_t number = 0;
  if (!ParseObjCorner(token, &number)) return false;
  const int64_t count = static_cast<int64_t>(vertices);
  const int64_t found = number < 0 ? count + number : number - 1;
  if (number < -count || found >= count) return false;
  *index = static_cast<uint32_t>(found);
  return true;
}

}  // namespace

absl::Status ReadObjMesh(ByteSource* source, TriangleMesh* mesh) {
  std::string_view line;
  std::vector<uint32_t> corners;
  while (source->ReadLine(&line)) {
    std::string_view rest = line;
    const std::string_view keyword = NextToken(&rest);
    if (keyword == "v") {
      if (absl::Status status = AddVertex(*source, rest, mesh); !status.ok()) return status;
    }
    if (keyword != "f") continue;
    corners.clear();
    for (std::string_view token; !(token = NextToken(&rest)).empty();) {
      if (!FindObjVertex(token, mesh->vertices.size(), &corners.emplace_back())) {
        return source->ErrorAtLine(
            absl::StrCat(Quoted(token), " names none of the ", mesh->vertices.size(), " vertices"));
      }
    }
    if (corners.empty()) return source->ErrorAtLine("a face names no vertex");
    AddPolygon(corners, mesh);
  }
  return source->status();
}

absl::Status ReadOffMesh(ByteSource* source, TriangleMesh* mesh) {
  OffReader reader(source);
  if (absl::Status status = reader.ReadHeader(); !status.ok()) return status;
  std::string_view content;
  for (uint64_t i = 0; i < reader.vertex_count(); ++i) {
    absl::Status status = reader.NextVertex(i, &content);
    if (status.ok()) status = AddVertex(*source, content, mesh);
    if (!status.ok()) return status;
  }
  std::vector<uint32_t> corners;
  for (uint64_t i = 0; i < reader.face_count(); ++i) {
    if (absl::Status status = reader.NextFace(i, &content); !status.ok()) return status;
    uint64_t size = 0;
    bool ok = ParseUnsigned(NextToken(&content), &size);
    corners.clear();
    for (uint64_t corner = 0; ok && corner < size; ++corner) {
      uint64_t index = 0;
      ok = ParseUnsigned(NextToken(&content), &index) && index < mesh->vertices.size();
      corners.push_back(static_cast<uint32_t>(index));
    }
    if (!ok) return source->ErrorAtLine("a face is its number of corners and that many vertices");
    AddPolygon(corners, mesh);
  }
  return absl::OkStatus();
}

absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path) {
  const absl::StatusOr<PointFormat> format = PointFormatOfPath(path);
  if (!format.ok()) return format.status();
  auto source = ByteSource::Open(path);
  if (!source.ok()) return source.status();
  TriangleMesh mesh;
  absl::Status status;
  switch (*format) {
    case PointFormat::kObj:
      status = ReadObjMesh(source->get(), &mesh);
      break;
    case PointFormat::kOff:
      status = ReadOffMesh(source->get(), &mesh);
      break;
    case PointFormat::kStl:
    case PointFormat::kGltf:
      status = ReadAssimpMesh(path, &mesh);
      break;
    default:
      status = absl::InvalidArgumentError(
          absl::StrCat(path,
                       ": no mesh is read from this format; convert it to obj, off, stl or "
                       "gltf"));
  }
  if (!status.ok()) return status;
  return mesh;
}

}  // namespace hulld
