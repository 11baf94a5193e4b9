// `create` and `get`.
#include <algorithm>
#include <initializer_list>
#include <memory>
#include <string>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

std::string CountsText(const v1::PointCounts& counts) {
  return std::to_string(counts.received()) + " received, " + std::to_string(counts.outside()) +
         " outside, " + std::to_string(counts.duplicate()) + " duplicate, " +
         std::to_string(counts.inside()) + " inside";
}

struct CreateOptions {
  std::string hull_id;
  bool if_absent = false;
};

ExitCode Create(const Invocation& run, const CreateOptions& options) {
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto response,
                       run.MakeClient().CreateHull(options.hull_id, options.if_absent));
  if (!run.PrintForPrograms(response, options.hull_id)) {
    run.out << options.hull_id << (response.created() ? " created" : " already exists")
            << " at revision " << response.hull().create_revision() << "\n";
  }
  return ExitCode::kDone;
}

// "8 within 0", with the largest of the bounds.
std::string WithinText(const std::string& value, std::initializer_list<double> bounds) {
  return value + " within " + ShortestText(std::max(bounds));
}

void AddProperties(const v1::HullProperties& properties, Table* table) {
  const auto number = [](const v1::BoundedValue& measure) {
    return WithinText(ShortestText(measure.value()), {measure.bound()});
  };
  const v1::Vector3& bounds = properties.centroid_bounds();
  const v1::SymmetricTensor& inertia = properties.inertia();
  const v1::SymmetricTensor& within = properties.inertia_bounds();
  table->Row({"volume", number(properties.volume())})
      .Row({"area", number(properties.area())})
      .Row({"centroid",
            WithinText(VectorText(properties.centroid()), {bounds.x(), bounds.y(), bounds.z()})})
      .Row({"inertia xx yy zz", WithinText(VectorText(inertia.xx(), inertia.yy(), inertia.zz()),
                                           {within.xx(), within.yy(), within.zz()})})
      .Row({"inertia xy xz yz", WithinText(VectorText(inertia.xy(), inertia.xz(), inertia.yz()),
                                           {within.xy(), within.xz(), within.yz()})});
}

void PrintHull(const Invocation& run, const v1::GetHullResponse& response) {
  const v1::HullInfo& hull = response.hull();
  Table table;
  table.Row({"hull", hull.hull_id()})
      .Row({"dimension", std::to_string(hull.dimension())})
      .Row({"vertices", std::to_string(hull.vertex_count())})
      .Row({"edges", std::to_string(response.edge_count())})
      .Row({"facets", std::to_string(response.facet_count())})
      .Row({"points", CountsText(hull.counts())});
  if (response.has_box_min()) {
    table.Row({"box from", VectorText(response.box_min())})
        .Row({"box to", VectorText(response.box_max())});
  }
  table.Row({"revision", std::to_string(hull.revision())})
      .Row({"created at", std::to_string(hull.create_revision())});
  if (run.wide()) {
    table.Row({"store", response.header().store_id()})
        .Row({"store revision", std::to_string(response.header().revision())});
  }
  if (response.has_properties()) AddProperties(response.properties(), &table);
  if (response.has_audit()) {
    const bool ok = response.audit().ok();
    table.Row({"audit", ok ? run.paint(Hue::kGood, "ok")
                           : run.paint(Hue::kBad, response.audit().finding())});
  }
  table.Print(run.out);
}

ExitCode GetHull(const Invocation& run, const v1::GetHullRequest& request) {
  const std::string& hull_id = request.hull_id();
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto response, run.MakeClient().GetHull(request));
  if (!run.PrintForPrograms(response, hull_id)) {
    PrintHull(run, response);
  }
  if (request.audit() && !response.audit().ok()) {
    run.err << "hullctl: the audit of " << hull_id << " found: " << response.audit().finding()
            << "; please report it with the points\n";
    return ExitCode::kRequestFailed;
  }
  return ExitCode::kDone;
}

}  // namespace

void AddCreateCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<CreateOptions>();
  Command command = program.AddCommand("create", "Register an empty hull");
  command.AddText("ID", &options->hull_id, "ID of the hull, such as arm/3").Required();
  command.AddFlag("--if-absent", &options->if_absent, "Succeed if the hull already exists");
  command.SetExamples({{"", "hullctl create arm/3"},
                       {"In a script that can run twice", "hullctl create arm/3 --if-absent"}});
  OnGiven(command, invocation, options, Create);
}

void AddGetCommand(Command program, Invocation* invocation) {
  auto request = std::make_shared<v1::GetHullRequest>();
  v1::GetHullRequest* const fields = request.get();
  Command command = program.AddCommand("get", "Show size, counts, and box of a hull");
  command.AddText("ID", fields->mutable_hull_id(), "ID of the hull")
      .Required()
      .Completes(ValueKind::kHull);
  command.AddFlag(
      "--properties", [fields] { fields->set_properties(true); },
      "Show volume, area, centroid, and the inertia tensor about the centroid, for density 1");
  command.AddFlag(
      "--audit", [fields] { fields->set_audit(true); },
      "Have the server check the hull with independent code");
  AddFreshnessOptions(command, invocation);
  command.SetExamples(
      {{"", "hullctl get arm/3"},
       {"How heavy is it, and where is its center of mass?", "hullctl get arm/3 --properties"},
       {"As JSON, for a script", "hullctl get arm/3 --output json"}});
  OnGiven(command, invocation, request, GetHull);
}

}  // namespace hulld
