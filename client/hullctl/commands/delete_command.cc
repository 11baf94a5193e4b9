#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/deletion.h"
#include "client/hullctl/printing/progress_bar.h"

namespace hulld {
namespace {

struct DeleteArguments {
  std::vector<std::string> hull_ids;
  std::string prefix;
  bool has_prefix = false;
  bool yes = false;
  bool if_exists = false;
  std::optional<uint64_t> if_revision;
};

// A hull to delete, with its revision in the list, if it was listed.
struct DeletionTarget {
  std::string hull_id;
  std::optional<uint64_t> if_revision;
};

// Returns true if the deletion is confirmed. A single hull given by name needs no confirmation;
// more need --yes or a confirmation at the terminal.
absl::StatusOr<bool> IsConfirmed(const Invocation& run, const DeleteArguments& arguments,
                                 const std::vector<DeletionTarget>& targets) {
  if (arguments.yes || (targets.size() == 1 && !arguments.has_prefix)) return true;
  std::vector<std::string> ids;
  ids.reserve(targets.size());
  for (const DeletionTarget& hull : targets) ids.push_back(hull.hull_id);
  return ConfirmDeletion(run, ids, "hull", "hulls");
}

absl::StatusOr<std::vector<DeletionTarget>> Choose(const Client& client,
                                                   const DeleteArguments& arguments) {
  std::vector<DeletionTarget> targets;
  std::set<std::string> named;
  for (const std::string& hull_id : arguments.hull_ids) {
    if (named.insert(hull_id).second) targets.push_back({hull_id, arguments.if_revision});
  }
  if (!arguments.has_prefix) return targets;
  const auto listed = client.ListAllHulls(arguments.prefix);
  if (!listed.ok()) return listed.status();
  for (const v1::HullInfo& hull : listed->hulls()) {
    // Keeps hulls that changed since the list. A damaged hull has no revision.
    std::optional<uint64_t> revision;
    if (!hull.damaged()) revision = hull.revision();
    targets.push_back({hull.hull_id(), revision});
  }
  return targets;
}

void PrintDeleted(const Invocation& run, const std::string& hull_id,
                  const v1::DeleteHullResponse& response) {
  if (!run.PrintForPrograms(response, hull_id)) {
    run.out << hull_id << " deleted at revision " << response.header().revision() << "\n";
  }
}

ExitCode DeleteAll(const Invocation& run, const Client& client, const DeleteArguments& arguments,
                   const std::vector<DeletionTarget>& targets) {
  ProgressBar bar(run.err, run.shows_progress, "hulls", targets.size());
  uint64_t deleted = 0;
  ExitCode worst = ExitCode::kDone;
  for (const DeletionTarget& hull : targets) {
    const auto response = client.DeleteHull(hull.hull_id, hull.if_revision);
    const bool gone = absl::IsNotFound(response.status());
    if (gone && (arguments.if_exists || arguments.has_prefix)) continue;
    bar.Clear();
    if (response.ok()) {
      ++deleted;
      PrintDeleted(run, hull.hull_id, *response);
      bar.Update(deleted);
      continue;
    }
    worst = run.Fail(response.status());
    // Without a server or permission, the remaining hulls would fail in the same way.
    const bool own = gone || absl::IsAborted(response.status());
    if (!own) break;
  }
  bar.Clear();
  if (worst == ExitCode::kDone || targets.size() == 1) return worst;
  run.err << "hullctl: deleted " << deleted << " of " << targets.size() << " hulls\n";
  return worst;
}

ExitCode DeleteHulls(const Invocation& run, const DeleteArguments& arguments) {
  if (arguments.hull_ids.empty() == !arguments.has_prefix) {
    return run.FailUsage("pass either the IDs of the hulls to delete or --prefix");
  }
  if (arguments.if_revision && arguments.hull_ids.size() != 1) {
    return run.FailUsage("--if-revision requires exactly one hull");
  }
  if (arguments.has_prefix && arguments.prefix.empty()) {
    return run.FailUsage("refusing to delete all hulls on the server: --prefix is empty");
  }
  const Client client = run.MakeClient();
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto targets, Choose(client, arguments));
  if (targets.empty()) {
    run.err << "hullctl: no hull ID starts with " << Quoted(arguments.prefix) << "\n";
    return ExitCode::kDone;
  }
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto confirmed, IsConfirmed(run, arguments, targets));
  if (!confirmed) return run.FailUsage("cancelled; nothing was deleted");
  return DeleteAll(run, client, arguments, targets);
}

}  // namespace

void AddDeleteCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<DeleteArguments>();
  Command command = program.AddCommand("delete", "Remove hulls");
  command.AddTexts("ID", &arguments->hull_ids, "IDs of the hulls").Completes(ValueKind::kHull);
  command
      .AddParsed(
          "--prefix",
          [arguments](const std::string& prefix) {
            arguments->prefix = prefix;
            arguments->has_prefix = true;
            return absl::OkStatus();
          },
          "Delete all hulls with this prefix, at their listed revisions, instead of IDs")
      .ValueName("PREFIX")
      .Completes(ValueKind::kHull);
  command.AddFlag("--yes", &arguments->yes, "Delete several hulls without confirmation");
  command.AddFlag("--if-exists", &arguments->if_exists, "Succeed if a hull does not exist");
  command.AddNumber("--if-revision", 0, kAnyNumber, "Only if the hull is at this revision",
                    &arguments->if_revision);
  command.SetDetails(
      "Deleting several hulls needs a confirmation on the terminal, or --yes. A hull that changes\n"
      "after --prefix listed it is kept, and the exit code is 1.");
  command.SetExamples({{"", "hullctl delete arm/3"},
                       {"All hulls of one cell", "hullctl delete --prefix cell-3/"},
                       {"In a script", "hullctl delete --prefix cell-3/ --yes"}});
  OnGiven(command, invocation, arguments, DeleteHulls);
}

}  // namespace hulld
