// Places the meshes of the nodes of a COLLADA document.
#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "client/formats/affine.h"
#include "client/formats/dae/dae_document.h"
#include "client/formats/dae/dae_mesh.h"
#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"
#include "client/pose/vector3.h"

namespace hulld {
namespace {

using pugi::xml_node;
using Vector = std::array<double, 3>;

// Limits for files whose nodes instantiate each other excessively.
constexpr int kMaxLevels = 256;
constexpr size_t kMaxElements = size_t{1} << 20;
constexpr size_t kMaxCorners = size_t{1} << 28;

constexpr std::array<LengthScale, 3> kUnscaled = {};

// Exact at multiples of 90 degrees.
double SineOfDegrees(double angle) {
  angle = std::remainder(angle, 360);
  if (std::abs(angle) > 90) angle = std::copysign(180, angle) - angle;
  if (std::abs(angle) == 90) return angle / 90;
  return std::sin(angle * (std::numbers::pi / 180));
}

double CosineOfDegrees(double angle) {
  return SineOfDegrees(90 - std::abs(std::remainder(angle, 360)));
}

// A mesh placed by a node.
struct PlacedMesh {
  // ID of the node, or its name if it has no ID.
  std::string node;
  // Number of the node in the order of visits.
  size_t number;
  const TriangleMesh& mesh;
  // Returns an error at the line of the geometry.
  std::function<absl::Status(const std::string& message)> error;
};

using PlacedMeshVisitor = std::function<absl::Status(const PlacedMesh& placed)>;

// Visits the meshes of the scene, scaled to meters, then by `scale` along x, y, and z.
class DaeWalk {
 public:
  DaeWalk(ByteSource* source, const std::array<LengthScale, 3>& scale, PlacedMeshVisitor visit)
      : source_(source), document_(source), scale_(scale), visit_(std::move(visit)) {}

  absl::Status Run() {
    if (absl::Status s = document_.Load(); !s.ok()) return s;
    for (LengthScale& scale : scale_) {
      const auto product = scale.Times(document_.unit());
      if (product) scale = *product;
      if (!product) {
        Fail(document_.root(), "has a unit that overflows a double when multiplied by the scale");
      }
    }
    VisitScene();
    if (vertices_ == 0) {
      document_.Keep(absl::InvalidArgumentError(
          absl::StrCat(source_->name(), ": the scene contains no vertex")));
    }
    return document_.status();
  }

 private:
  bool ok() const { return document_.ok(); }
  void Fail(xml_node node, const std::string& predicate) { document_.Fail(node, predicate); }

  void VisitScene() {
    const xml_node root = document_.root();
    bool is_shown = false;
    for (const xml_node shown : DaeDocument::ChildOf(root, "scene").children()) {
      if (DaeDocument::NameOf(shown) != "instance_visual_scene") continue;
      is_shown = true;
      VisitNode(document_.TargetOf(shown, "visual_scene"), Affine(), 0);
    }
    // Without a scene, visits all visual scenes; without these, all geometries.
    for (const std::string_view kind : {"visual_scene", "geometry"}) {
      if (is_shown) return;
      for (const xml_node library : root.children()) {
        for (const xml_node child : library.children()) {
          if (DaeDocument::NameOf(child) != kind) continue;
          is_shown = true;
          if (kind == "geometry") {
            VisitGeometry(child, child, ++number_, Affine());
          } else {
            VisitNode(child, Affine(), 0);
          }
        }
      }
    }
  }

  // Visits a node, or the nodes of a visual scene.
  void VisitNode(xml_node node, const Affine& X_WP, int level) {
    if (!ok()) return;
    if (level > kMaxLevels) {
      return Fail(node, absl::StrCat("is nested deeper than ", kMaxLevels,
                                     " levels; does it instantiate itself?"));
    }
    const size_t number = ++number_;
    Affine X_WN = X_WP;
    for (const xml_node child : node.children()) {
      if (ok()) X_WN = X_WN * TransformOf(child);
    }
    for (const xml_node child : node.children()) {
      if (++elements_ > kMaxElements) {
        Fail(node, absl::StrCat("is instantiated too often: the scene has more than ", kMaxElements,
                                " elements"));
      }
      if (!ok()) return;
      const std::string_view kind = DaeDocument::NameOf(child);
      if (kind == "node") VisitNode(child, X_WN, level + 1);
      if (kind == "instance_node") VisitNode(document_.TargetOf(child, "node"), X_WN, level + 1);
      if (kind == "instance_geometry") {
        VisitGeometry(document_.TargetOf(child, "geometry"), node, number, X_WN);
      }
      if (kind == "instance_controller") {
        Fail(child,
             "instantiates a mesh with a skin or morph targets, which is not supported; "
             "export it as a plain mesh");
      }
    }
  }

  // number: that of the node.
  void VisitGeometry(xml_node geometry, xml_node node, size_t number, const Affine& X_WN) {
    if (!ok()) return;
    const bool is_moved = X_WN.m != Affine().m;
    const auto [entry, is_new] =
        meshes_.emplace(std::pair(geometry.internal_object(), is_moved), TriangleMesh());
    TriangleMesh& mesh = entry->second;
    if (is_new) mesh = ReadDaeMesh(geometry, is_moved ? kUnscaled : scale_, &document_);
    vertices_ += mesh.vertices.size();
    corners_ += mesh.vertices.size() + 3 * mesh.triangles.size();
    if (corners_ > kMaxCorners) {
      Fail(node, absl::StrCat("is instantiated too often: the scene has more than ", kMaxCorners,
                              " vertices and corners of triangles"));
    }
    if (!ok()) return;
    const auto error = [&](const std::string& message) {
      return absl::InvalidArgumentError(
          absl::StrCat(source_->name(), ":", document_.LineOf(geometry), ": ", message));
    };
    TriangleMesh moved;
    if (is_moved) moved = mesh;
    for (Vector& vertex : moved.vertices) {
      const Vector p = X_WN * vertex;
      for (size_t axis = 0; axis < 3; ++axis) {
        vertex[axis] = scale_[axis].Apply(p[axis]);
        if (!std::isfinite(vertex[axis]) && std::isfinite(p[axis])) {
          document_.Keep(error("a scaled coordinate exceeds the largest double"));
        }
      }
    }
    std::string name;
    for (const char* attribute : {"id", "name", "sid"}) {
      if (name.empty()) name = node.attribute(attribute).value();
    }
    if (ok()) document_.Keep(visit_({name, number, is_moved ? moved : mesh, error}));
  }

  // Returns the identity if the element is not a transform.
  Affine TransformOf(xml_node element) {
    const std::string_view kind = DaeDocument::NameOf(element);
    Affine X;
    if (kind == "matrix") {
      const std::vector<double> v = document_.NumbersOf(element, 16);
      if (v[12] != 0 || v[13] != 0 || v[14] != 0 || v[15] != 1) {
        Fail(element, "has a last row other than 0 0 0 1");
      }
      for (size_t i = 0; i < 12; ++i) X.m[i / 4][i % 4] = v[i];
    } else if (kind == "translate" || kind == "scale") {
      const std::vector<double> v = document_.NumbersOf(element, 3);
      for (size_t i = 0; i < 3; ++i) X.m[i][kind == "scale" ? i : 3] = v[i];
    } else if (kind == "rotate") {
      const std::vector<double> v = document_.NumbersOf(element, 4);
      if (std::remainder(v[3], 360) != 0) X = Rotation(element, v.data(), v[3]);
    } else if (kind == "lookat") {
      const std::vector<double> v = document_.NumbersOf(element, 9);
      X = LookAt(element, v);
    } else if (kind == "skew") {
      X = Skew(element, document_.NumbersOf(element, 7));
    }
    return X;
  }

  Vector UnitVector(xml_node element, const Vector& v) {
    const double length = std::hypot(v[0], v[1], v[2]);
    if (!(length > 0)) {
      Fail(element, "has a direction of length 0");
      return {};
    }
    return {v[0] / length, v[1] / length, v[2] / length};
  }

  // R = a a' + c (I - a a') + s [a]x for the unit vector a along the axis.
  Affine Rotation(xml_node element, const double* axis, double angle) {
    const Vector a = UnitVector(element, {axis[0], axis[1], axis[2]});
    const double c = CosineOfDegrees(angle);
    const double s = SineOfDegrees(angle);
    Affine X;
    for (size_t i = 0; i < 3; ++i) {
      const size_t j = (i + 1) % 3;
      const size_t k = (i + 2) % 3;
      X.m[i][i] = a[i] * a[i] + c * (1 - a[i] * a[i]);
      X.m[i][j] = (1 - c) * a[i] * a[j] - s * a[k];
      X.m[j][i] = (1 - c) * a[i] * a[j] + s * a[k];
    }
    return X;
  }

  // The eye is the origin; -z points to the target, and y up.
  Affine LookAt(xml_node element, const std::vector<double>& v) {
    const Vector back = UnitVector(element, {v[0] - v[3], v[1] - v[4], v[2] - v[5]});
    const Vector right = UnitVector(element, Cross({v[6], v[7], v[8]}, back));
    const Vector up = Cross(back, right);
    Affine X;
    for (size_t i = 0; i < 3; ++i) X.m[i] = {right[i], up[i], back[i], v[i]};
    return X;
  }

  // Shears the first axis by the angle toward the second one, which is perpendicular to it.
  Affine Skew(xml_node element, const std::vector<double>& v) {
    const Vector from = UnitVector(element, {v[1], v[2], v[3]});
    const Vector to = UnitVector(element, {v[4], v[5], v[6]});
    if (!(std::abs(Dot(from, to)) <= 0x1p-20) || std::abs(std::remainder(v[0], 180)) >= 90) {
      Fail(element, "has axes that are not at right angles, or an angle of 90");
    }
    const double slope = SineOfDegrees(v[0]) / CosineOfDegrees(v[0]);
    Affine X;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 3; ++j) X.m[i][j] += slope * to[i] * from[j];
    }
    return X;
  }

  ByteSource* source_;
  DaeDocument document_;
  std::array<LengthScale, 3> scale_;
  PlacedMeshVisitor visit_;
  // Meshes by geometry, and by whether a transform moves them.
  std::map<std::pair<pugi::xml_node_struct*, bool>, TriangleMesh> meshes_;
  size_t number_ = 0;
  size_t elements_ = 0;
  size_t vertices_ = 0;
  size_t corners_ = 0;
};

}  // namespace

absl::Status ReadDae(ByteSource* source, PointCollector* points) {
  const auto visit = [points](const PlacedMesh& placed) {
    for (size_t i = 0; i < placed.mesh.vertices.size(); ++i) {
      const auto error_at = [&](const std::string& message) {
        return placed.error(absl::StrCat("vertex ", i, " of ", Quoted(placed.node), ": ", message));
      };
      const auto& [x, y, z] = placed.mesh.vertices[i];
      if (absl::Status s = points->AddScaled(x, y, z, error_at); !s.ok()) return s;
    }
    return absl::OkStatus();
  };
  return DaeWalk(source, points->scale(), visit).Run();
}

absl::Status ReadDaeParts(ByteSource* source, std::vector<MeshPart>* parts) {
  std::optional<size_t> last;
  const auto visit = [&](const PlacedMesh& placed) {
    for (const auto& [x, y, z] : placed.mesh.vertices) {
      if (std::isfinite(x) && std::isfinite(y) && std::isfinite(z)) continue;
      return placed.error(absl::StrCat("a vertex of ", Quoted(placed.node), " is not finite"));
    }
    if (last != placed.number) parts->push_back({placed.node, {}});
    last = placed.number;
    return AddMesh(source->name(), placed.mesh, &parts->back().mesh);
  };
  return DaeWalk(source, {}, visit).Run();
}

}  // namespace hulld
