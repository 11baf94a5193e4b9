#include <absl/strings/str_cat.h>

#include <cmath>
#include <memory>
#include <optional>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/freshness_options.h"
#include "client/hullctl/command_line/output_file.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/mesh_obj.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"
#include "client/verify/simplification_check.h"

namespace hulld {
namespace {

struct MeshArguments {
  std::string hull_id;
  std::string file;
  uint64_t max_vertices = 0;
  double max_error = 0;
  bool outside = false;
  bool verify = false;
};

v1::GetHullMeshRequest RequestFor(const MeshArguments& arguments) {
  v1::GetHullMeshRequest request;
  request.set_hull_id(arguments.hull_id);
  if (arguments.max_vertices == 0 && arguments.max_error == 0) return request;
  v1::Simplification* simplification = request.mutable_simplification();
  simplification->set_side(arguments.outside ? v1::SIMPLIFICATION_SIDE_OUTSIDE
                                             : v1::SIMPLIFICATION_SIDE_INSIDE);
  simplification->set_max_vertices(arguments.max_vertices);
  simplification->set_max_error(arguments.max_error);
  return request;
}

// Writes the mesh as the messages of its stream: header, vertices, facets.
void WriteMessages(const HullMesh& mesh, std::ostream& out) {
  v1::GetHullMeshResponse header;
  *header.mutable_header() = mesh.header;
  out << MessageJson(header) << "\n";
  v1::GetHullMeshResponse vertices;
  vertices.mutable_vertices()->mutable_xyz()->Add(mesh.xyz.begin(), mesh.xyz.end());
  out << MessageJson(vertices) << "\n";
  if (mesh.facet_sizes.empty()) return;
  v1::GetHullMeshResponse facets;
  facets.mutable_facets()->mutable_sizes()->Add(mesh.facet_sizes.begin(), mesh.facet_sizes.end());
  facets.mutable_facets()->mutable_indices()->Add(mesh.facet_indices.begin(),
                                                  mesh.facet_indices.end());
  out << MessageJson(facets) << "\n";
}

// Returns the mesh. With --verify, its verification states any claim that does not hold.
absl::StatusOr<VerifiedMesh> Fetch(const Invocation& run, const MeshArguments& arguments) {
  const v1::GetHullMeshRequest request = RequestFor(arguments);
  std::optional<ProgressBar> bar;
  const auto show = [&](const HullMesh& so_far) {
    const uint64_t total = so_far.header.vertex_count() + so_far.header.facet_count();
    if (!bar) bar.emplace(run.err, run.shows_progress, "vertices", total);
    bar->Update(so_far.vertex_count() + so_far.facet_sizes.size(), so_far.vertex_count());
  };
  const Client client = run.MakeClient();
  if (arguments.verify) return GetSimplificationVerified(client, request, show);
  absl::StatusOr<HullMesh> mesh = client.GetHullMesh(request, show);
  if (!mesh.ok()) return mesh.status();
  return VerifiedMesh{*std::move(mesh), {}};
}

ExitCode RefuseSimplification(const Invocation& run, const Verification& verification) {
  const bool invalid = verification.verdict == Verdict::kInvalid;
  run.err << "hullctl: the simplification " << (invalid ? "is invalid" : "cannot be checked")
          << "; nothing was written: " << verification.reason << "\n";
  return invalid ? ExitCode::kInvalidCertificate : ExitCode::kCannotCheck;
}

ExitCode Mesh(const Invocation& run, const MeshArguments& arguments) {
  const bool is_simplified = arguments.max_vertices > 0 || arguments.max_error > 0;
  if (arguments.outside && !is_simplified) {
    return run.FailUsage("--outside needs --max-vertices, --max-error, or both");
  }
  if (arguments.verify && !is_simplified) {
    return run.FailUsage(
        "--verify checks a simplification; it needs --max-vertices, --max-error, or both");
  }
  if (const auto format = PointFormatOfPath(arguments.file);
      format.ok() && *format != PointFormat::kObj) {
    return run.FailUsage(absl::StrCat(arguments.file,
                                      ": meshes are written as OBJ; choose a name that ends in "
                                      ".obj, and convert the file"));
  }
  const auto fetched = Fetch(run, arguments);
  if (!fetched.ok()) return run.Fail(fetched.status());
  if (arguments.verify && fetched->verification.verdict != Verdict::kValid) {
    return RefuseSimplification(run, fetched->verification);
  }
  const HullMesh* const mesh = &fetched->mesh;
  const absl::Status written = WriteOutput(arguments.file, run.out, [&](std::ostream& out) {
    run.json() ? WriteMessages(*mesh, out) : WriteObj(*mesh, out);
  });
  if (!written.ok()) return run.FailUsage(written);
  if (!arguments.file.empty() && arguments.file != "-") {
    run.err << arguments.file << ": " << Counted(mesh->vertex_count(), "vertex", "vertices") << ", "
            << Counted(mesh->facet_sizes.size(), "facet") << " of " << arguments.hull_id
            << " at revision " << mesh->header.hull().revision() << ErrorText(*mesh)
            << (arguments.verify ? ", verified" : "") << "\n";
  }
  return ExitCode::kDone;
}

}  // namespace

void AddMeshCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<MeshArguments>();
  Command command = program.AddCommand("mesh", "Write a hull as OBJ");
  command.AddText("ID", &arguments->hull_id, "ID of the hull")
      .Required()
      .Completes(ValueKind::kHull);
  command.AddText("-o,--out", &arguments->file, "File to write (default: standard output)")
      .ValueName("FILE");
  command.AddNumber("--max-vertices", 1, kAnyNumber, "Simplify to at most N vertices",
                    &arguments->max_vertices);
  const auto take_max_error = [arguments](const std::string& text) {
    double& length = arguments->max_error;
    const bool is_number = ParseDouble(text, &length) == NumberText::kNumber;
    if (is_number && std::isfinite(length) && length > 0) return absl::OkStatus();
    return absl::InvalidArgumentError(Quoted(text) + " is not a positive length");
  };
  command
      .AddParsed("--max-error", take_max_error,
                 "Simplify while the proven distance to the hull stays within this length")
      .ValueName("LENGTH");
  command.AddFlag("--outside", &arguments->outside,
                  "Simplify to a hull that encloses this one, instead of one inside it");
  command.AddFlag("--verify", &arguments->verify,
                  "Fetch the hull as well, and check the simplification and its error exactly");
  AddFreshnessOptions(command, invocation);
  command.SetDetails(
      "Coordinates read back as the same doubles. Facets are whole polygons, counter-clockwise\n"
      "from outside; a flat hull is one facet, a segment an `l`, a point a `p`.\n"
      "--verify uses only vertices from the server: hullctl's own exact arithmetic shows that the\n"
      "simplification is inside or outside, and within its error of the hull. An invalid\n"
      "simplification is not written.");
  command.SetExamples({{"", "hullctl mesh spider -o spider-hull.obj"},
                       {"At most 16 vertices, enclosing the hull",
                        "hullctl mesh spider --max-vertices 16 --outside -o simple.obj"}});
  OnGiven(command, invocation, arguments, Mesh);
}

}  // namespace hulld
