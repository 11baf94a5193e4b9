#include "client/hullctl/robot/mesh_pieces.h"

#include <absl/strings/str_cat.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/enclosure/mesh_volume.h"
#include "client/formats/point_file.h"
#include "client/pose/vector3.h"

namespace hulld {
namespace {

using Vector = std::array<double, 3>;

constexpr size_t kMaxConvexVertices = 4096;
constexpr double kRelativeTolerance = 1e-3;
constexpr off_t kMaxMeshBytes = off_t{64} << 20;

double DiagonalOf(const TriangleMesh& mesh) {
  Vector low = mesh.vertices[0];
  Vector high = low;
  for (const Vector& p : mesh.vertices) {
    for (size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  return std::sqrt(Dot(Minus(high, low), Minus(high, low)));
}

void Scale(const std::array<LengthScale, 3>& scale, TriangleMesh* mesh) {
  for (Vector& p : mesh->vertices) {
    for (size_t axis = 0; axis < 3; ++axis) p[axis] = scale[axis].Apply(p[axis]);
  }
}

absl::StatusOr<std::vector<MeshPiece>> ScaledPieces(std::vector<MeshPart> parts,
                                                    const CollisionShape& shape,
                                                    const std::string& file) {
  std::vector<MeshPiece> pieces;
  for (MeshPart& part : parts) {
    Scale(shape.scale, &part.mesh);
    MeshPiece& piece = pieces.emplace_back();
    for (const Vector& p : part.mesh.vertices) {
      for (const double x : p) {
        if (!std::isfinite(x)) {
          return absl::InvalidArgumentError(absl::StrCat(
              file, ": a scaled coordinate exceeds the largest double; use a smaller scale"));
        }
        piece.hull.xyz.push_back(x);
      }
    }
    piece.mesh = std::move(part.mesh);
  }
  return pieces;
}

bool IsSmall(const std::string& file) {
  struct stat info = {};
  return stat(file.c_str(), &info) == 0 && info.st_size <= kMaxMeshBytes;
}

bool AreConvexParts(const std::vector<MeshPart>& parts) {
  return parts.size() > 1 && std::all_of(parts.begin(), parts.end(), [](const MeshPart& part) {
           return IsConvexPart(part.mesh);
         });
}

}  // namespace

bool IsConvexPart(const TriangleMesh& mesh) {
  if (mesh.vertices.size() > kMaxConvexVertices || !IsClosed(mesh)) return false;
  const double tolerance = kRelativeTolerance * DiagonalOf(mesh);
  // All triangles may face inward.
  double highest = 0;
  double lowest = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector& p = mesh.vertices[a];
    const Vector n = Cross(Minus(mesh.vertices[b], p), Minus(mesh.vertices[c], p));
    const double length = std::sqrt(Dot(n, n));
    // The normal of a sliver is dominated by rounding.
    if (length <= tolerance * tolerance) continue;
    for (const Vector& q : mesh.vertices) {
      const double height = Dot(n, Minus(q, p)) / length;
      highest = std::max(highest, height);
      lowest = std::min(lowest, height);
    }
    if (highest > tolerance && lowest < -tolerance) return false;
  }
  return true;
}

absl::StatusOr<std::vector<MeshPiece>> MeshPieces(const CollisionShape& shape,
                                                  const std::string& file, MeshSplit split) {
  const auto format = PointFormatOfPath(file);
  const bool has_triangles = format.ok() && IsMeshFormat(*format);
  if (has_triangles && (split == MeshSplit::kNames || split == MeshSplit::kComponents)) {
    auto parts = ReadParts(file, split == MeshSplit::kNames ? SplitBy::kName : SplitBy::kComponent);
    if (!parts.ok()) return parts.status();
    return ScaledPieces(*std::move(parts), shape, file);
  }
  const bool reads_mesh = has_triangles && IsSmall(file);
  if (reads_mesh && split == MeshSplit::kAutomatic) {
    // The points of a file with broken faces still have a hull.
    auto parts = ReadParts(file, SplitBy::kName);
    if (parts.ok() && AreConvexParts(*parts)) return ScaledPieces(*std::move(parts), shape, file);
  }
  auto hull = MeshHull(shape, file);
  if (!hull.ok()) return hull.status();
  std::vector<MeshPiece> pieces(1);
  pieces[0].hull = *std::move(hull);
  auto mesh = reads_mesh ? ReadMesh(file) : TriangleMesh();
  if (mesh.ok()) pieces[0].mesh = *std::move(mesh);
  Scale(shape.scale, &pieces[0].mesh);
  return pieces;
}

}  // namespace hulld
