// COLLADA through assimp, which holds every coordinate as float.
#include <absl/strings/str_cat.h>
#include <assimp/config.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <charconv>
#include <cmath>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "client/formats/length_scale.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"

namespace hulld {
namespace {

// A row-major 3 x 4 matrix: rotation, scale and shear, then translation.
struct NodeTransform {
  double m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  bool is_identity = true;
};

NodeTransform Compose(const NodeTransform& parent, const aiMatrix4x4& local) {
  if (local.IsIdentity()) return parent;
  NodeTransform product;
  product.is_identity = false;
  for (unsigned row = 0; row < 3; ++row) {
    for (unsigned column = 0; column < 4; ++column) {
      double sum = column == 3 ? parent.m[row][3] : 0;
      for (unsigned k = 0; k < 3; ++k) {
        sum += parent.m[row][k] * static_cast<double>(local[k][column]);
      }
      product.m[row][column] = sum;
    }
  }
  return product;
}

// Placement of a mesh in the scene: the transform of its node, then the factor from the file's unit
// to meters.
struct MeshPlacement {
  NodeTransform X_WM;
  LengthScale unit;
  bool is_identity() const { return X_WM.is_identity && unit.is_one(); }
};

std::array<double, 3> operator*(const MeshPlacement& placement, const aiVector3D& p) {
  std::array<double, 3> q = {p.x, p.y, p.z};
  for (size_t row = 0; row < 3; ++row) {
    const double* const m = placement.X_WM.m[row];
    if (!placement.X_WM.is_identity) q[row] = m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3];
    q[row] = placement.unit.Apply(q[row]);
  }
  return q;
}

absl::Status AddPoints(const std::string& path, const aiMesh& mesh, const MeshPlacement& placement,
                       PointCollector* points) {
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const auto error_at = [&](const std::string& message) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": vertex ", i, " of mesh \"", mesh.mName.C_Str(), "\": ", message));
    };
    const aiVector3D& p = mesh.mVertices[i];
    absl::Status status;
    if (placement.is_identity()) {
      status = points->AddFloat(p.x, p.y, p.z, error_at);
    } else {
      const auto [x, y, z] = placement * p;
      status = points->Add(x, y, z, error_at);
    }
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status AddTriangles(const std::string& path, const aiMesh& mesh,
                          const MeshPlacement& placement, TriangleMesh* to) {
  const size_t first = to->vertices.size();
  if (first + mesh.mNumVertices > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": too many vertices"));
  }
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const std::array<double, 3>& p = to->vertices.emplace_back(placement * mesh.mVertices[i]);
    if (!std::isfinite(p[0] + p[1] + p[2])) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": vertex ", i, " is not finite"));
    }
  }
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    for (unsigned corner = 2; corner < face.mNumIndices; ++corner) {
      std::array<uint32_t, 3> triangle = {face.mIndices[0], face.mIndices[corner - 1],
                                          face.mIndices[corner]};
      for (uint32_t& index : triangle) {
        if (index >= mesh.mNumVertices) {
          return absl::InvalidArgumentError(absl::StrCat(path, ": a face names no vertex"));
        }
        index += static_cast<uint32_t>(first);
      }
      to->triangles.push_back(triangle);
    }
  }
  return absl::OkStatus();
}

using MeshVisitor = std::function<absl::Status(const aiMesh& mesh, const MeshPlacement& placement,
                                               const aiNode& node)>;

// Returns the factor that assimp makes the transform of the root, a float. Its shortest decimal
// text is that of the file, so 3 inches become the double nearest to 0.0762, rounded once.
LengthScale UnitOf(const aiScene& scene) {
  char text[32];
  const char* const end =
      std::to_chars(text, text + sizeof(text), scene.mRootNode->mTransformation.a1).ptr;
  return LengthScale::FromText({text, static_cast<size_t>(end - text)}).value_or(LengthScale());
}

absl::Status VisitMeshes(const aiScene& scene, const MeshVisitor& visit) {
  std::vector<std::pair<const aiNode*, MeshPlacement>> pending = {
      {scene.mRootNode, {NodeTransform(), UnitOf(scene)}}};
  while (!pending.empty()) {
    auto [node, placement] = pending.back();
    pending.pop_back();
    if (node != scene.mRootNode) placement.X_WM = Compose(placement.X_WM, node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      absl::Status status = visit(*scene.mMeshes[node->mMeshes[i]], placement, *node);
      if (!status.ok()) return status;
    }
    // Pushed in reverse, so that the order is the file's.
    for (unsigned i = node->mNumChildren; i > 0; --i) {
      pending.emplace_back(node->mChildren[i - 1], placement);
    }
  }
  return absl::OkStatus();
}

// No post-processing: assimp then neither joins nor drops vertices.
absl::Status ReadThroughAssimp(const std::string& path, const MeshVisitor& visit) {
  Assimp::Importer importer;
  // COLLADA: otherwise assimp rotates files that are not Y_UP.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  // Otherwise assimp draws the nodes of a scene without meshes, and invents vertices.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* scene = nullptr;
  std::string problem;
  try {
    scene = importer.ReadFile(path, 0);
    problem = importer.GetErrorString();
  } catch (const std::exception& exception) {
    problem = exception.what();
  }
  if (scene != nullptr && scene->mRootNode != nullptr) return VisitMeshes(*scene, visit);
  return absl::InvalidArgumentError(absl::StrCat(path, ": cannot be read: ", problem));
}

}  // namespace

absl::Status ReadDae(const std::string& path, PointCollector* points) {
  bool is_empty = true;
  absl::Status read = ReadThroughAssimp(
      path, [&](const aiMesh& mesh, const MeshPlacement& placement, const aiNode&) {
        is_empty = is_empty && mesh.mNumVertices == 0;
        return AddPoints(path, mesh, placement, points);
      });
  if (!read.ok() || !is_empty) return read;
  return absl::InvalidArgumentError(absl::StrCat(path, ": it contains no vertex"));
}

absl::Status ReadDaeParts(const std::string& path, std::vector<MeshPart>* parts) {
  std::map<const aiNode*, size_t> part_of;
  return ReadThroughAssimp(
      path, [&](const aiMesh& mesh, const MeshPlacement& placement, const aiNode& node) {
        if (mesh.mNumFaces == 0) return absl::OkStatus();
        const auto [entry, is_new] = part_of.emplace(&node, parts->size());
        if (is_new) {
          const aiString& name = node.mName.length > 0 ? node.mName : mesh.mName;
          parts->push_back({name.C_Str(), {}});
        }
        return AddTriangles(path, mesh, placement, &(*parts)[entry->second].mesh);
      });
}

}  // namespace hulld
