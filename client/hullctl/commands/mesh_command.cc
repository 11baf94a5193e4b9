#include <absl/strings/str_cat.h>

#include <cmath>
#include <memory>
#include <optional>

#include "client/formats/point_file.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
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

// Returns the origin of a simplified mesh and its proven error, as in ", simplified from 72
// vertices within 0.5"; empty for a hull itself.
std::string ErrorText(const HullMesh& mesh) {
  if (!mesh.header.has_error()) return "";
  return ", simplified from " + std::to_string(mesh.header.hull().vertex_count()) +
         " vertices within " + ShortestText(mesh.header.error());
}

// Writes a hull as OBJ text: vertices in canonical order with the shortest digits that read back as
// the same doubles, and maximal facets. A hull of dimension 1 is an edge `l`, one of dimension 0 a
// point `p`; an empty hull has only the comment.
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
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto fetched, Fetch(run, arguments));
  if (arguments.verify && fetched.verification.verdict != Verdict::kValid) {
    return RefuseSimplification(run, fetched.verification);
  }
  const HullMesh* const mesh = &fetched.mesh;
  const ExitCode written = run.WriteFile(arguments.file, [&](std::ostream& out) {
    run.json() ? WriteMessages(*mesh, out) : WriteObj(*mesh, out);
  });
  if (written == ExitCode::kDone && !arguments.file.empty() && arguments.file != "-") {
    run.err << arguments.file << ": " << Counted(mesh->vertex_count(), "vertex", "vertices") << ", "
            << Counted(mesh->facet_sizes.size(), "facet") << " of " << arguments.hull_id
            << " at revision " << mesh->header.hull().revision() << ErrorText(*mesh)
            << (arguments.verify ? ", verified" : "") << "\n";
  }
  return written;
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
