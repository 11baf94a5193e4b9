// `create` and `get`.
#include <memory>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/freshness_options.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

std::string CountsText(const v1::PointCounts& counts) {
  return std::to_string(counts.received()) + " received, " + std::to_string(counts.outside()) +
         " outside, " + std::to_string(counts.duplicate()) + " duplicate, " +
         std::to_string(counts.inside()) + " inside";
}

ExitCode Create(const Invocation& run, const std::string& hull_id, bool if_absent) {
  const auto response = run.MakeClient().CreateHull(hull_id, if_absent);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json()) {
    run.out << MessageJson(*response) << "\n";
  } else if (run.names()) {
    run.out << hull_id << "\n";
  } else {
    run.out << hull_id << (response->created() ? " created" : " already exists") << " at revision "
            << response->hull().create_revision() << "\n";
  }
  return ExitCode::kDone;
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
  if (response.has_audit()) {
    const bool ok = response.audit().ok();
    table.Row({"audit", ok ? run.paint(Hue::kGood, "ok")
                           : run.paint(Hue::kBad, response.audit().finding())});
  }
  table.Print(run.out);
}

ExitCode GetHull(const Invocation& run, const std::string& hull_id, bool audit) {
  const auto response = run.MakeClient().GetHull(hull_id, audit);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json()) {
    run.out << MessageJson(*response) << "\n";
  } else if (run.names()) {
    run.out << hull_id << "\n";
  } else {
    PrintHull(run, *response);
  }
  if (audit && !response->audit().ok()) {
    run.err << "hullctl: the audit of " << hull_id << " found: " << response->audit().finding()
            << "; please report it with the points\n";
    return ExitCode::kRequestFailed;
  }
  return ExitCode::kDone;
}

struct HullOptions {
  std::string hull_id;
  bool flag = false;
};

}  // namespace

void AddCreateCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<HullOptions>();
  Command command = program.AddCommand("create", "Register an empty hull");
  command.AddText("ID", &options->hull_id, "ID of the hull, such as arm/3").Required();
  command.AddFlag("--if-absent", &options->flag, "Succeed if the hull exists");
  command.SetExamples({{"", "hullctl create arm/3"},
                       {"In a script that can run twice", "hullctl create arm/3 --if-absent"}});
  command.OnGiven([=] {
    invocation->action = [=] { return Create(*invocation, options->hull_id, options->flag); };
  });
}

void AddGetCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<HullOptions>();
  Command command = program.AddCommand("get", "Show size, counts, and box of a hull");
  command.AddText("ID", &options->hull_id, "ID of the hull").Required().Completes(ValueKind::kHull);
  command.AddFlag("--audit", &options->flag,
                  "Make the server check the hull with independent code");
  AddFreshnessOptions(command, invocation);
  command.SetExamples(
      {{"", "hullctl get arm/3"}, {"As JSON, for a script", "hullctl get arm/3 --output json"}});
  command.OnGiven([=] {
    invocation->action = [=] { return GetHull(*invocation, options->hull_id, options->flag); };
  });
}

}  // namespace hulld
