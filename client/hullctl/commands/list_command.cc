#include <algorithm>
#include <functional>
#include <map>
#include <memory>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct ListArguments {
  std::string prefix;
  uint64_t limit = 0;
  std::string sort;
  bool reverse = false;
  bool count = false;
};

// Sort keys of a list: largest first, but IDs ascend.
using SortKey = std::function<uint64_t(const v1::HullInfo&)>;
const std::map<std::string, SortKey>& SortKeys() {
  static const auto* const kKeys = new std::map<std::string, SortKey>{
      {"id", nullptr},
      {"vertices", [](const v1::HullInfo& hull) { return hull.vertex_count(); }},
      {"points", [](const v1::HullInfo& hull) { return hull.counts().received(); }},
      {"revision", [](const v1::HullInfo& hull) { return hull.revision(); }},
      {"created", [](const v1::HullInfo& hull) { return hull.create_revision(); }}};
  return *kKeys;
}

void Sort(const ListArguments& arguments, v1::ListHullsResponse* response) {
  const SortKey& key = SortKeys().at(arguments.sort.empty() ? "id" : arguments.sort);
  auto begin = response->mutable_hulls()->pointer_begin();
  auto end = response->mutable_hulls()->pointer_end();
  // Hulls arrive in order of IDs; equal keys keep that order.
  if (key != nullptr) {
    std::stable_sort(begin, end, [&key](const v1::HullInfo* a, const v1::HullInfo* b) {
      return key(*a) > key(*b);
    });
  }
  if (arguments.reverse) std::reverse(begin, end);
}

// bodies: the number of bodies; not shown in lists of names.
void PrintCount(const Invocation& run, const v1::ListHullsResponse& response, uint64_t bodies) {
  uint64_t vertices = 0;
  uint64_t points = 0;
  for (const v1::HullInfo& hull : response.hulls()) {
    vertices += hull.vertex_count();
    points += hull.counts().received();
  }
  const auto hulls = static_cast<uint64_t>(response.hulls_size());
  JsonObject json;
  json.Add("hulls", hulls).Add("vertices", vertices).Add("points", points).Add("bodies", bodies);
  if (run.PrintForPrograms(json.Close(), std::to_string(hulls))) return;
  Table table;
  table.Row({"hulls", std::to_string(hulls)})
      .Row({"vertices", std::to_string(vertices)})
      .Row({"points", std::to_string(points)});
  if (bodies > 0) table.Row({"bodies", std::to_string(bodies)});
  table.Print(run.out);
}

void PrintHullTable(const Invocation& run, const v1::ListHullsResponse& response) {
  Table table;
  std::vector<std::string> head = {"HULL", "DIMENSION", "VERTICES", "POINTS", "REVISION"};
  if (run.wide()) head.insert(head.end(), {"CREATED", "OUTSIDE", "DUPLICATE", "INSIDE", "STATE"});
  table.Head(run.paint, head);
  for (const v1::HullInfo& hull : response.hulls()) {
    const v1::PointCounts& counts = hull.counts();
    std::vector<std::string> row = {
        hull.hull_id(), std::to_string(hull.dimension()), std::to_string(hull.vertex_count()),
        std::to_string(counts.received()), std::to_string(hull.revision())};
    if (run.wide()) {
      row.insert(row.end(),
                 {std::to_string(hull.create_revision()), std::to_string(counts.outside()),
                  std::to_string(counts.duplicate()), std::to_string(counts.inside()),
                  hull.damaged() ? run.paint(Hue::kBad, "damaged") : "ok"});
    }
    table.Row(row);
  }
  table.Print(run.out);
}

ExitCode ListHulls(const Invocation& run, const ListArguments& arguments) {
  // Sorting needs the complete list before the limit applies.
  const bool sorts = arguments.reverse || !arguments.sort.empty();
  HULLD_ASSIGN_OR_FAIL(
      run.Fail, auto response,
      run.MakeClient().ListAllHulls(arguments.prefix, sorts ? 0 : arguments.limit));
  Sort(arguments, &response);
  bool cut = !response.next_page_token().empty();
  const uint64_t limit = arguments.limit;
  if (sorts && limit > 0 && static_cast<uint64_t>(response.hulls_size()) > limit) {
    const int keep = static_cast<int>(limit);
    response.mutable_hulls()->DeleteSubrange(keep, response.hulls_size() - keep);
    cut = true;
  }
  if (arguments.count) {
    uint64_t bodies = 0;
    if (!run.names()) {
      HULLD_ASSIGN_OR_FAIL(run.Fail, const auto listed,
                           run.MakeClient().ListAllBodies(arguments.prefix));
      bodies = static_cast<uint64_t>(listed.bodies_size());
    }
    PrintCount(run, response, bodies);
  } else if (run.json()) {
    run.out << MessageJson(response) << "\n";
  } else if (run.names()) {
    for (const v1::HullInfo& hull : response.hulls()) run.out << hull.hull_id() << "\n";
  } else {
    PrintHullTable(run, response);
  }
  for (const v1::HullInfo& hull : response.hulls()) {
    if (!hull.damaged()) continue;
    run.err << "hullctl: " << hull.hull_id()
            << " is damaged in the store; it can only be deleted\n";
  }
  if (cut) run.err << "hullctl: there are more hulls; raise --limit to list them\n";
  return ExitCode::kDone;
}

}  // namespace

void AddListCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<ListArguments>();
  Command command = program.AddCommand("list", "List the hulls and their sizes");
  command.AddText("PREFIX", &arguments->prefix, "Only IDs with this prefix")
      .Completes(ValueKind::kHull);
  std::vector<std::string> keys;
  for (const auto& [name, key] : SortKeys()) keys.push_back(name);
  command.AddText("--sort", &arguments->sort, "Sort by size, largest first, or by name")
      .ValueName("BY")
      .OneOf(keys);
  command.AddFlag("--reverse", &arguments->reverse, "Reverse the order");
  command.AddNumber("--limit", 1, 1000000000, "Stop after N hulls (default: all)",
                    &arguments->limit);
  command.AddFlag("--count", &arguments->count,
                  "Print only the numbers of hulls, vertices, points, and bodies");
  AddFreshnessOptions(command, invocation);
  command.SetExamples({{"Hulls of one cell", "hullctl list cell-3/"},
                       {"The ten largest", "hullctl list --sort vertices --limit 10"},
                       {"Number of hulls", "hullctl list --count"},
                       {"IDs only, for a script", "hullctl list arm/ --output name"}});
  OnGiven(command, invocation, arguments, ListHulls);
}

}  // namespace hulld
