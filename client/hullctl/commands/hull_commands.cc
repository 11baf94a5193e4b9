// create, get, list and delete: one hull, or the list of all.
#include <memory>
#include <optional>

#include "client/formats/text_number.h"
#include "client/hullctl/commands/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

std::string PointText(const v1::Vector3& p) {
  return ShortestText(p.x()) + " " + ShortestText(p.y()) + " " + ShortestText(p.z());
}

std::string CountsText(const v1::PointCounts& counts) {
  return std::to_string(counts.received()) + " received, " + std::to_string(counts.outside()) +
         " outside, " + std::to_string(counts.duplicate()) + " duplicate, " +
         std::to_string(counts.inside()) + " inside";
}

ExitCode Create(const Invocation& run, const std::string& hull_id, bool if_absent) {
  const auto response = run.MakeClient().CreateHull(hull_id, if_absent);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json) {
    run.out << MessageJson(*response) << "\n";
  } else {
    run.out << hull_id << (response->created() ? " created" : " exists already") << " at revision "
            << response->hull().create_revision() << "\n";
  }
  return ExitCode::kDone;
}

void PrintHull(const v1::GetHullResponse& response, std::ostream& out) {
  const v1::HullInfo& hull = response.hull();
  Table table;
  table.Row({"hull", hull.hull_id()})
      .Row({"dimension", std::to_string(hull.dimension())})
      .Row({"vertices", std::to_string(hull.vertex_count())})
      .Row({"edges", std::to_string(response.edge_count())})
      .Row({"facets", std::to_string(response.facet_count())})
      .Row({"points", CountsText(hull.counts())});
  if (response.has_box_min()) {
    table.Row({"box from", PointText(response.box_min())})
        .Row({"box to", PointText(response.box_max())});
  }
  table.Row({"revision", std::to_string(hull.revision())})
      .Row({"created at", std::to_string(hull.create_revision())});
  if (response.has_audit()) {
    table.Row({"audit", response.audit().ok() ? "ok" : response.audit().finding()});
  }
  table.Print(out);
}

ExitCode Get(const Invocation& run, const std::string& hull_id, bool audit) {
  const auto response = run.MakeClient().GetHull(hull_id, audit);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json) {
    run.out << MessageJson(*response) << "\n";
  } else {
    PrintHull(*response, run.out);
  }
  if (audit && !response->audit().ok()) {
    run.err << "hullctl: the audit of " << hull_id << " found: " << response->audit().finding()
            << "; please report it with the points\n";
    return ExitCode::kRequestFailed;
  }
  return ExitCode::kDone;
}

ExitCode List(const Invocation& run, const std::string& prefix, uint64_t limit) {
  const auto response = run.MakeClient().ListAllHulls(prefix, limit);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json) {
    run.out << MessageJson(*response) << "\n";
    return ExitCode::kDone;
  }
  Table table;
  table.Row({"HULL", "DIMENSION", "VERTICES", "POINTS", "REVISION"});
  for (const v1::HullInfo& hull : response->hulls()) {
    table.Row({hull.hull_id(), std::to_string(hull.dimension()),
               std::to_string(hull.vertex_count()), std::to_string(hull.counts().received()),
               std::to_string(hull.revision())});
  }
  table.Print(run.out);
  if (!response->next_page_token().empty()) {
    run.err << "hullctl: there are more hulls; raise --limit to see them\n";
  }
  return ExitCode::kDone;
}

ExitCode Delete(const Invocation& run, const std::string& hull_id,
                std::optional<uint64_t> if_revision) {
  const auto response = run.MakeClient().DeleteHull(hull_id, if_revision);
  if (!response.ok()) return run.Fail(response.status());
  if (run.json) {
    run.out << MessageJson(*response) << "\n";
  } else {
    run.out << hull_id << " deleted at revision " << response->header().revision() << "\n";
  }
  return ExitCode::kDone;
}

struct HullOptions {
  std::string hull_id;
  bool flag = false;
  uint64_t limit = 0;
  std::optional<uint64_t> if_revision;
};

}  // namespace

void AddCreateCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<HullOptions>();
  Command command = program.AddCommand("create", "Register an empty hull");
  command.AddText("ID", &options->hull_id, "Name of the hull, such as arm/3").Required();
  command.AddFlag("--if-absent", &options->flag, "Accept a hull that exists already");
  command.OnGiven([=] {
    invocation->action = [=] { return Create(*invocation, options->hull_id, options->flag); };
  });
}

void AddGetCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<HullOptions>();
  Command command = program.AddCommand("get", "Show size, counts and box of a hull");
  command.AddText("ID", &options->hull_id, "Name of the hull").Required();
  command.AddFlag("--audit", &options->flag,
                  "Also let the server check the hull by other means than it was built by");
  command.OnGiven([=] {
    invocation->action = [=] { return Get(*invocation, options->hull_id, options->flag); };
  });
}

void AddListCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<HullOptions>();
  Command command = program.AddCommand("list", "List the hulls by name");
  command.AddText("PREFIX", &options->hull_id, "Only names that start with it");
  command.AddNumber("--limit", 1, kAnyNumber, "Stop after N hulls (default: all)",
                    [options](uint64_t number) { options->limit = number; });
  command.OnGiven([=] {
    invocation->action = [=] { return List(*invocation, options->hull_id, options->limit); };
  });
}

void AddDeleteCommand(Command program, Invocation* invocation) {
  auto options = std::make_shared<HullOptions>();
  Command command = program.AddCommand("delete", "Remove a hull");
  command.AddText("ID", &options->hull_id, "Name of the hull").Required();
  command.AddNumber("--if-revision", 0, kAnyNumber, "Only if its revision is this one",
                    [options](uint64_t number) { options->if_revision = number; });
  command.OnGiven([=] {
    invocation->action = [=] {
      return Delete(*invocation, options->hull_id, options->if_revision);
    };
  });
}

}  // namespace hulld
