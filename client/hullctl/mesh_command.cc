#include <CLI/CLI.hpp>
#include <memory>

#include "client/formats/text_number.h"
#include "client/hullctl/commands.h"
#include "client/hullctl/mesh_obj.h"
#include "client/hullctl/output_file.h"

namespace hulld {
namespace {

struct MeshArguments {
  std::string hull_id;
  std::string file;
};

ExitCode Mesh(const Invocation& run, const MeshArguments& arguments) {
  const auto mesh = run.MakeClient().GetHullMesh(arguments.hull_id);
  if (!mesh.ok()) return run.Fail(mesh.status());
  const absl::Status written =
      WriteOutput(arguments.file, run.out, [&](std::ostream& out) { WriteObj(*mesh, out); });
  if (!written.ok()) return run.FailUsage(written);
  if (!arguments.file.empty() && arguments.file != "-") {
    run.err << arguments.file << ": " << mesh->vertex_count() << " vertices, "
            << mesh->facet_sizes.size() << " facets of " << arguments.hull_id << " at revision "
            << mesh->header.hull().revision() << "\n";
  }
  return ExitCode::kDone;
}

}  // namespace

void AddMeshCommand(CLI::App* app, Invocation* invocation) {
  auto arguments = std::make_shared<MeshArguments>();
  CLI::App* command = app->add_subcommand("mesh", "Write a hull as OBJ");
  command->add_option("ID", arguments->hull_id, "Name of the hull")->required();
  command->add_option("-o,--out", arguments->file, "File to write (default: standard output)")
      ->type_name("FILE");
  command->footer(
      "Coordinates read back as the same doubles. Facets are whole polygons, counter-clockwise\n"
      "from outside; a flat hull is one facet, a segment an `l`, a point a `p`.");
  command->callback([=] { invocation->action = [=] { return Mesh(*invocation, *arguments); }; });
}

}  // namespace hulld
