// Places the meshes of the nodes of a glTF document, with morph targets and skins.
#include <absl/strings/str_cat.h>
#include <google/protobuf/struct.pb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "client/formats/affine.h"
#include "client/formats/gltf/gltf_document.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

// A primitive of a mesh, placed by a node.
struct Primitive {
  std::string node;
  // The node's index, or the mesh's index if the file has no nodes.
  size_t number = 0;
  TriangleMesh mesh;
  // True if the vertices are floats of the file, not transformed.
  bool is_float = false;
};

using PrimitiveVisitor = std::function<absl::Status(const Primitive& primitive)>;

// Visits the primitives of the scene.
class GltfWalk {
 public:
  GltfWalk(ByteSource* source, PrimitiveVisitor visit)
      : document_(source), visit_(std::move(visit)) {}

  absl::Status Run() {
    if (absl::Status s = document_.Load(); !s.ok()) return s;
    VisitScene();
    place_.clear();
    if (ok() && vertices_ == 0) Fail("the meshes of the scene have no vertex");
    return document_.status();
  }

 private:
  bool ok() const { return document_.ok(); }
  void Fail(const std::string& message) {
    document_.Fail(place_.empty() ? message : absl::StrCat(Quoted(place_), ": ", message));
  }

  static std::vector<std::array<uint32_t, 3>> Triangles(const std::vector<uint32_t>& corners,
                                                        size_t mode) {
    constexpr size_t kTriangles = 4;
    constexpr size_t kStrip = 5;
    constexpr size_t kFan = 6;
    std::vector<std::array<uint32_t, 3>> triangles;
    if (mode < kTriangles) return triangles;
    for (size_t i = 2; i < corners.size(); i += mode == kTriangles ? 3 : 1) {
      const size_t odd = mode == kStrip && i % 2 != 0 ? 1 : 0;
      triangles.push_back(
          {corners[mode == kFan ? 0 : i - 2 + odd], corners[i - 1 - odd], corners[i]});
    }
    return triangles;
  }

  // Keeps the vertices named by `corners`, in order. Primitives may share the positions of one
  // accessor.
  static void KeepOnly(const std::vector<uint32_t>& corners, TriangleMesh* mesh) {
    constexpr uint32_t kUnused = std::numeric_limits<uint32_t>::max();
    std::vector<uint32_t> number(mesh->vertices.size(), kUnused);
    for (const uint32_t corner : corners) number[corner] = 0;
    uint32_t kept = 0;
    for (size_t i = 0; i < number.size(); ++i) {
      if (number[i] == kUnused) continue;
      mesh->vertices[kept] = mesh->vertices[i];
      number[i] = kept++;
    }
    mesh->vertices.resize(kept);
    for (auto& triangle : mesh->triangles) {
      for (uint32_t& corner : triangle) corner = number[corner];
    }
  }

  // Adds the weighted displacements of the morph targets.
  void Morph(const Struct& object, const std::vector<double>& weights, Primitive* primitive) {
    const auto& targets = document_.ListOf(object, "targets").values();
    const size_t count = std::min(weights.size(), static_cast<size_t>(targets.size()));
    for (size_t target = 0; target < count && ok(); ++target) {
      const Value* const position =
          GltfDocument::Find(targets[static_cast<int>(target)].struct_value(), "POSITION");
      if (weights[target] == 0 || position == nullptr) continue;
      const auto shifts = document_.ElementsOf<3>(document_.Integer(*position, "POSITION"));
      auto& vertices = primitive->mesh.vertices;
      if (ok() && shifts.size() != vertices.size()) {
        Fail(absl::StrCat("a morph target has ", Counted(shifts.size(), "position"), " for ",
                          Counted(vertices.size(), "vertex", "vertices")));
      }
      for (size_t i = 0; i < vertices.size() && ok(); ++i) {
        for (size_t axis = 0; axis < 3; ++axis) {
          vertices[i][axis] += weights[target] * shifts[i][axis];
        }
      }
      primitive->is_float = false;
    }
  }

  // Moves each vertex by the weighted mean of its joints' transforms in the file's pose. Returns
  // false if the primitive has no joints.
  bool ApplySkin(const Struct& attributes, const std::vector<Affine>& joints,
                 Primitive* primitive) {
    auto& vertices = primitive->mesh.vertices;
    std::vector<std::array<double, 3>> sums(vertices.size());
    std::vector<double> totals(vertices.size());
    for (size_t set = 0; ok(); ++set) {
      const Value* const joint = GltfDocument::Find(attributes, absl::StrCat("JOINTS_", set));
      const Value* const weight = GltfDocument::Find(attributes, absl::StrCat("WEIGHTS_", set));
      if (set == 0 && joint == nullptr) return false;
      if (joint == nullptr || weight == nullptr) break;
      const auto indices = document_.ElementsOf<4>(document_.Integer(*joint, "JOINTS"));
      const auto weights = document_.ElementsOf<4>(document_.Integer(*weight, "WEIGHTS"));
      if (ok() && (indices.size() != vertices.size() || weights.size() != vertices.size())) {
        Fail("a primitive has more or fewer joints than vertices");
      }
      for (size_t i = 0; i < vertices.size() && ok(); ++i) {
        for (size_t k = 0; k < 4; ++k) {
          if (weights[i][k] == 0) continue;
          if (!(indices[i][k] >= 0 && indices[i][k] < static_cast<double>(joints.size()))) {
            Fail(absl::StrCat("vertex ", i, " has the joint ", indices[i][k], ", but the skin has ",
                              joints.size()));
            break;
          }
          const auto moved = joints[static_cast<size_t>(indices[i][k])] * vertices[i];
          for (size_t axis = 0; axis < 3; ++axis) sums[i][axis] += weights[i][k] * moved[axis];
          totals[i] += weights[i][k];
        }
      }
    }
    for (size_t i = 0; i < vertices.size() && ok(); ++i) {
      if (totals[i] == 0) Fail(absl::StrCat("vertex ", i, " has no joint weight"));
      // Rounding makes the sum of the weights inexact.
      for (size_t axis = 0; axis < 3; ++axis) vertices[i][axis] = sums[i][axis] / totals[i];
    }
    primitive->is_float = false;
    return true;
  }

  // Returns the transform of each joint of a skin, from the mesh to the scene.
  std::vector<Affine> JointsOf(size_t index) {
    const Struct& skin = document_.Element("skins", index);
    std::vector<Affine> joints;
    for (const Value& joint : document_.ListOf(skin, "joints").values()) {
      const size_t node = document_.Integer(joint, "joints");
      if (!ok()) return {};
      if (node >= X_WN_.size() || !X_WN_[node].has_value()) {
        Fail(absl::StrCat("skins[", index, "]: the joint nodes[", node, "] is not in the scene"));
        return {};
      }
      joints.push_back(*X_WN_[node]);
    }
    const auto inverse = document_.IntegerOf(skin, "inverseBindMatrices");
    if (!ok() || !inverse) return joints;
    const auto matrices = document_.ElementsOf<16>(*inverse);
    if (ok() && matrices.size() < joints.size()) {
      Fail(absl::StrCat("skins[", index, "] has fewer inverseBindMatrices than joints"));
    }
    for (size_t i = 0; i < joints.size() && ok(); ++i) {
      joints[i] = joints[i] * FromColumns({matrices[i].begin(), matrices[i].end()});
    }
    return joints;
  }

  void VisitPrimitive(const Struct& object, const Affine* X_WN, const Struct& node,
                      const std::vector<double>& weights, Primitive* primitive) {
    const Struct& attributes = document_.ObjectOf(object, "attributes");
    const Value* const position = GltfDocument::Find(attributes, "POSITION");
    if (!ok() || position == nullptr) return;
    if (GltfDocument::Find(document_.ObjectOf(object, "extensions"),
                           "KHR_draco_mesh_compression") != nullptr &&
        GltfDocument::Find(document_.Element("accessors", document_.Integer(*position, "POSITION")),
                           "bufferView") == nullptr) {
      return document_.RefuseExtension("KHR_draco_mesh_compression");
    }
    const size_t mode = document_.IntegerOf(object, "mode").value_or(4);
    if (mode > 6) return Fail(absl::StrCat("a primitive has an unknown mode ", mode));
    std::vector<std::array<double, 3>>& vertices = primitive->mesh.vertices;
    vertices =
        document_.ElementsOf<3>(document_.Integer(*position, "POSITION"), &primitive->is_float);
    std::vector<uint32_t> corners;
    const auto index = document_.IntegerOf(object, "indices");
    if (ok() && index) {
      const Struct& accessor = document_.Element("accessors", *index);
      const size_t count = document_.IntegerOf(accessor, "count").value_or(0);
      corners = document_.Indices(accessor, count, vertices.size(),
                                  absl::StrCat("accessors[", *index, "]"));
    } else if (mode >= 4) {
      for (uint32_t i = 0; i < vertices.size(); ++i) corners.push_back(i);
    }
    if (mode == 4 && index && corners.size() % 3 != 0) {
      Fail(absl::StrCat("a primitive has ", corners.size(),
                        " corners, not three for each triangle"));
    }
    if (!ok()) return;
    primitive->mesh.triangles = Triangles(corners, mode);
    Morph(object, weights, primitive);
    const auto skin = document_.IntegerOf(node, "skin");
    // A mesh with a skin is placed by the joints alone.
    const bool skinned = ok() && skin && ApplySkin(attributes, JointsOf(*skin), primitive);
    if (!ok()) return;
    if (index) KeepOnly(corners, &primitive->mesh);
    vertices_ += vertices.size();
    if (X_WN != nullptr && !skinned) {
      for (auto& vertex : vertices) vertex = *X_WN * vertex;
      primitive->is_float = false;
    }
    document_.Keep(visit_(*primitive));
  }

  // X_WN: null for the identity. node: empty if the file has none.
  void VisitMesh(size_t index, const Affine* X_WN, const Struct& node, Primitive primitive) {
    place_ = primitive.node;
    const Struct& mesh = document_.Element("meshes", index);
    const Struct& weighted = GltfDocument::Find(node, "weights") != nullptr ? node : mesh;
    const std::vector<double> weights = document_.NumbersOf(
        weighted, "weights", document_.ListOf(weighted, "weights").values_size());
    for (const Value& value : document_.ListOf(mesh, "primitives").values()) {
      if (!value.has_struct_value()) Fail("a primitive is not an object");
      if (!ok()) return;
      VisitPrimitive(value.struct_value(), X_WN, node, weights, &primitive);
    }
  }

  Affine FromColumns(const std::vector<double>& columns) {
    if (columns[3] != 0 || columns[7] != 0 || columns[11] != 0 || columns[15] != 1) {
      Fail("the last row of a matrix is not 0 0 0 1");
    }
    Affine X;
    for (size_t i = 0; i < 12; ++i) X.m[i % 3][i / 3] = columns[i / 3 * 4 + i % 3];
    return X;
  }

  // Returns the name of element `index` of a list, or the location if it has none.
  std::string NameOf(const Struct& element, const char* list, size_t index) {
    const std::string name = document_.TextOf(element, "name");
    return name.empty() ? absl::StrCat(list, "[", index, "]") : name;
  }

  // Returns nullopt if the node has no transform.
  std::optional<Affine> TransformOf(const Struct& node) {
    for (const char* const other : {"translation", "rotation", "scale"}) {
      if (GltfDocument::Find(node, "matrix") == nullptr) break;
      if (GltfDocument::Find(node, other) == nullptr) continue;
      Fail(absl::StrCat("has both matrix and ", other, "; remove one of them"));
    }
    const std::vector<double> columns = document_.NumbersOf(node, "matrix", 16);
    const std::vector<double> t = document_.NumbersOf(node, "translation", 3);
    const std::vector<double> q = document_.NumbersOf(node, "rotation", 4);
    const std::vector<double> s = document_.NumbersOf(node, "scale", 3);
    Affine X;
    if (!columns.empty()) {
      X = FromColumns(columns);
    } else {
      if (!q.empty()) {
        const double x = q[0], y = q[1], z = q[2], w = q[3];
        // Not 1: files contain rounded floats.
        const double n = x * x + y * y + z * z + w * w;
        if (!(n > 0 && std::isfinite(n))) Fail("a rotation is not a unit quaternion");
        X.m = {
            {{1 - 2 * (y * y + z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n, 0},
             {2 * (x * y + w * z) / n, 1 - 2 * (x * x + z * z) / n, 2 * (y * z - w * x) / n, 0},
             {2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, 1 - 2 * (x * x + y * y) / n, 0}}};
      }
      for (size_t row = 0; row < 3; ++row) {
        for (size_t column = 0; column < 3 && !s.empty(); ++column) X.m[row][column] *= s[column];
        if (!t.empty()) X.m[row][3] = t[row];
      }
    }
    if (X.m == Affine().m) return std::nullopt;
    return X;
  }

  // Depth first, in the order of the file. A node has at most one parent.
  void VisitNodes(const std::vector<size_t>& roots) {
    X_WN_.resize(document_.CountOf("nodes"));
    std::vector<bool> is_moved(document_.CountOf("nodes"));
    std::vector<size_t> order;
    std::vector<std::pair<size_t, std::optional<Affine>>> pending;
    for (size_t i = roots.size(); i > 0; --i) pending.emplace_back(roots[i - 1], std::nullopt);
    while (!pending.empty() && ok()) {
      const auto [index, X_WP] = pending.back();
      pending.pop_back();
      const Struct& node = document_.Element("nodes", index);
      if (!ok()) return;
      place_ = NameOf(node, "nodes", index);
      if (X_WN_[index]) return Fail("has several parents");
      if (GltfDocument::Find(document_.ObjectOf(node, "extensions"), "EXT_mesh_gpu_instancing") !=
          nullptr) {
        return document_.RefuseExtension("EXT_mesh_gpu_instancing");
      }
      std::optional<Affine> X_WN = TransformOf(node);
      if (X_WP) X_WN = X_WN ? *X_WP * *X_WN : *X_WP;
      X_WN_[index] = X_WN.value_or(Affine());
      is_moved[index] = X_WN.has_value();
      order.push_back(index);
      const auto& children = document_.ListOf(node, "children").values();
      for (int i = children.size(); i > 0; --i) {
        pending.emplace_back(document_.Integer(children[i - 1], "children"), X_WN);
      }
    }
    for (const size_t index : order) {
      if (!ok()) return;
      const Struct& node = document_.Element("nodes", index);
      if (const auto mesh = document_.IntegerOf(node, "mesh"); ok() && mesh) {
        VisitMesh(*mesh, is_moved[index] ? &*X_WN_[index] : nullptr, node,
                  {NameOf(node, "nodes", index), index, {}, false});
      }
    }
  }

  // Visits the default scene, or all scenes if there is no default. Scenes may share nodes.
  void VisitScene() {
    std::vector<size_t> roots;
    if (const size_t scenes = document_.CountOf("scenes"); scenes > 0) {
      const auto chosen = document_.IntegerOf(document_.root(), "scene");
      std::vector<bool> is_root(document_.CountOf("nodes"));
      for (size_t i = chosen.value_or(0); i < (chosen ? *chosen + 1 : scenes) && ok(); ++i) {
        for (const Value& node :
             document_.ListOf(document_.Element("scenes", i), "nodes").values()) {
          const size_t root = document_.Integer(node, "nodes");
          if (root < is_root.size() && is_root[root]) continue;
          if (root < is_root.size()) is_root[root] = true;
          roots.push_back(root);
        }
      }
      return VisitNodes(roots);
    }
    std::vector<bool> is_child(document_.CountOf("nodes"));
    for (size_t i = 0; i < is_child.size() && ok(); ++i) {
      for (const Value& child :
           document_.ListOf(document_.Element("nodes", i), "children").values()) {
        const size_t index = document_.Integer(child, "children");
        if (index < is_child.size()) is_child[index] = true;
      }
    }
    for (size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) roots.push_back(i);
    }
    if (!is_child.empty() && roots.empty())
      return Fail("no node is a root: each one is the child of another");
    if (!roots.empty()) return VisitNodes(roots);
    for (size_t i = 0; i < document_.CountOf("meshes") && ok(); ++i) {
      VisitMesh(i, nullptr, Struct::default_instance(),
                {NameOf(document_.Element("meshes", i), "meshes", i), i, {}, false});
    }
  }

  GltfDocument document_;
  const PrimitiveVisitor visit_;
  // Transforms of the scene's nodes.
  std::vector<std::optional<Affine>> X_WN_;
  size_t vertices_ = 0;
  // Name of the node or mesh that is read, for errors.
  std::string place_;
};

}  // namespace

absl::Status ReadGltf(ByteSource* source, PointCollector* points) {
  const auto visit = [&](const Primitive& primitive) {
    const auto& vertices = primitive.mesh.vertices;
    for (size_t i = 0; i < vertices.size(); ++i) {
      const auto error_at = [&](const std::string& message) {
        return absl::InvalidArgumentError(absl::StrCat(source->name(), ": vertex ", i, " of ",
                                                       Quoted(primitive.node), ": ", message));
      };
      const auto& [x, y, z] = vertices[i];
      absl::Status status = primitive.is_float
                                ? points->AddFloat(static_cast<float>(x), static_cast<float>(y),
                                                   static_cast<float>(z), error_at)
                                : points->Add(x, y, z, error_at);
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  };
  return GltfWalk(source, visit).Run();
}

absl::Status ReadGltfParts(ByteSource* source, std::vector<MeshPart>* parts) {
  std::optional<size_t> last;
  const auto visit = [&](const Primitive& primitive) {
    for (const auto& [x, y, z] : primitive.mesh.vertices) {
      if (std::isfinite(x) && std::isfinite(y) && std::isfinite(z)) continue;
      return absl::InvalidArgumentError(
          absl::StrCat(source->name(), ": a vertex of ", Quoted(primitive.node), " is not finite"));
    }
    if (last != primitive.number) parts->push_back({primitive.node, {}});
    last = primitive.number;
    return AddMesh(source->name(), primitive.mesh, &parts->back().mesh);
  };
  return GltfWalk(source, visit).Run();
}

}  // namespace hulld
