#include <memory>

#include "client/formats/mesh_file.h"
#include "client/formats/point_file.h"
#include "client/hullctl/command_line/output_file.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/picture/scene_svg.h"

namespace hulld {
namespace {

struct PictureArguments {
  std::string points;
  std::string mesh;
  std::string hull_id;
  std::string file;
  std::string up = "y";
};

std::string FileName(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

// Keeps every 2^k-th point of a stream, with the smallest k that stays within a bound.
class Thinner {
 public:
  void Add(const std::array<double, 3>& p) {
    if (count_++ % step_ != 0) return;
    kept_.push_back(p);
    if (kept_.size() < kMaxKept) return;
    size_t half = 0;
    for (size_t i = 0; i < kept_.size(); i += 2) kept_[half++] = kept_[i];
    kept_.resize(half);
    step_ *= 2;
  }
  uint64_t count() const { return count_; }
  std::vector<std::array<double, 3>> TakeKept() { return std::move(kept_); }

 private:
  static constexpr size_t kMaxKept = 12000;
  std::vector<std::array<double, 3>> kept_;
  uint64_t count_ = 0;
  uint64_t step_ = 1;
};

absl::StatusOr<ScenePanel> PointsPanel(const std::string& path) {
  const auto format = path == "-" ? PointFormat::kXyz : PointFormatOfPath(path);
  if (!format.ok()) return format.status();
  ReadRequest request{path, *format, {}, {}};
  request.options.skip_nonfinite = true;
  Thinner thinner;
  const auto counts = ReadPoints(request, [&thinner](const PointBlock& block) {
    for (size_t i = 0; i < block.xyz.size(); i += 3) {
      thinner.Add({block.xyz[i], block.xyz[i + 1], block.xyz[i + 2]});
    }
    for (size_t i = 0; i < block.xyz_float.size(); i += 3) {
      thinner.Add({block.xyz_float[i], block.xyz_float[i + 1], block.xyz_float[i + 2]});
    }
    return absl::OkStatus();
  });
  if (!counts.ok()) return counts.status();
  ScenePanel panel{ScenePanel::Kind::kPoints, "Points", {}, {}, {}, {}};
  panel.captions = {GroupedDigits(thinner.count()) + " points", FileName(path)};
  panel.vertices = thinner.TakeKept();
  return panel;
}

absl::StatusOr<ScenePanel> MeshPanel(const std::string& path) {
  const auto mesh = ReadMesh(path);
  if (!mesh.ok()) return mesh.status();
  ScenePanel panel{ScenePanel::Kind::kMesh, "Mesh", {}, mesh->vertices, {}, {}};
  panel.captions = {GroupedDigits(mesh->vertices.size()) + " vertices, " +
                        GroupedDigits(mesh->triangles.size()) + " triangles",
                    FileName(path)};
  panel.polygon_sizes.assign(mesh->triangles.size(), 3);
  for (const auto& triangle : mesh->triangles) {
    panel.polygon_indices.insert(panel.polygon_indices.end(), triangle.begin(), triangle.end());
  }
  return panel;
}

ScenePanel HullPanel(const HullMesh& mesh) {
  ScenePanel panel{ScenePanel::Kind::kHull, "Hull", {}, {}, mesh.facet_sizes, mesh.facet_indices};
  for (size_t i = 0; i < mesh.xyz.size(); i += 3) {
    panel.vertices.push_back({mesh.xyz[i], mesh.xyz[i + 1], mesh.xyz[i + 2]});
  }
  panel.captions = {GroupedDigits(mesh.vertex_count()) + " vertices, " +
                        GroupedDigits(mesh.facet_sizes.size()) + " facets",
                    mesh.header.hull().hull_id()};
  return panel;
}

ExitCode Picture(const Invocation& run, const PictureArguments& arguments) {
  std::vector<ScenePanel> panels;
  if (!arguments.points.empty()) {
    auto panel = PointsPanel(arguments.points);
    if (!panel.ok()) return run.FailUsage(panel.status());
    panels.push_back(*std::move(panel));
  }
  if (!arguments.mesh.empty()) {
    auto panel = MeshPanel(arguments.mesh);
    if (!panel.ok()) return run.FailUsage(panel.status());
    panels.push_back(*std::move(panel));
  }
  if (!arguments.hull_id.empty()) {
    const auto mesh = run.MakeClient().GetHullMesh(arguments.hull_id);
    if (!mesh.ok()) return run.Fail(mesh.status());
    panels.push_back(HullPanel(*mesh));
  }
  if (panels.empty()) {
    return run.FailUsage(absl::InvalidArgumentError(
        "nothing to draw; name one or more of --points FILE, --mesh FILE and --hull ID"));
  }
  const UpAxis up = arguments.up == "x"   ? UpAxis::kX
                    : arguments.up == "y" ? UpAxis::kY
                                          : UpAxis::kZ;
  const absl::Status written = WriteOutput(
      arguments.file, run.out, [&](std::ostream& out) { out << RenderSceneSvg(panels, up); });
  return written.ok() ? ExitCode::kDone : run.FailUsage(written);
}

}  // namespace

void AddPictureCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<PictureArguments>();
  Command command =
      program.AddCommand("picture", "Draw points, a mesh and a hull side by side as SVG");
  command.AddText("--points", &arguments->points, "File of points to draw as dots")
      .ValueName("FILE");
  command
      .AddText("--mesh", &arguments->mesh, "Mesh to draw with shading: obj, off, stl, gltf or dae")
      .ValueName("FILE");
  command.AddText("--hull", &arguments->hull_id, "Hull of the server to draw")
      .ValueName("ID")
      .Completes(ValueKind::kHull);
  command.AddText("-o,--out", &arguments->file, "File to write (default: standard output)")
      .ValueName("FILE");
  command.AddText("--up", &arguments->up, "The axis that points up (default y)")
      .ValueName("AXIS")
      .OneOf({"x", "y", "z"});
  command.SetDetails(
      "All panels show one view at one scale. Many points or triangles are thinned out;\n"
      "the captions count all of them.");
  command.SetExamples({{"A file and the hull of it",
                        "hullctl picture --points spider.obj --hull spider -o spider.svg"}});
  command.OnGiven([=] {
    invocation->needs_server = !arguments->hull_id.empty();
    invocation->action = [=] { return Picture(*invocation, *arguments); };
  });
}

}  // namespace hulld
