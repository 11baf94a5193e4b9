#include <absl/strings/str_cat.h>

#include <memory>
#include <vector>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/deletion.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/scene/scene_sync.h"
#include "client/hullctl/scene/yaml_scene.h"

namespace hulld {
namespace {

constexpr char kYamlHelp[] =
    "A scene in YAML:\n"
    "  prefix: cell-3/            # of the IDs on the server; a prefix that ends with / belongs\n"
    "                             # to this scene alone\n"
    "  scale: mm                  # default for files: mm, cm, m, in, ft, or a factor\n"
    "  hulls:\n"
    "    bracket: {file: bracket.stl, scale: cm}    # the hull of the file's points\n"
    "    table: {box: [2, 1, 0.1]}                  # edges; centered on the origin\n"
    "    wedge: {points: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"
    "  bodies:                    # several hulls as one\n"
    "    corner:\n"
    "      - {hull: bracket}\n"
    "      - {hull: wedge, at: [0, 0, 0.1], radius: 0.01}\n"
    "  place:                     # hulls and bodies at poses; pairs within a group are excluded\n"
    "    floor: {hull: table, at: [0, 0, -0.05], group: building}\n"
    "    left: {body: corner, at: {xyz: [1, 0, 0], rpy: [0, 0, 1.57]}}\n"
    "    arm: {id: arm/upper}     # a hull or body of the server\n"
    "    drop: {hull: wedge, at: [0, 0, 2], to: [0, 0, 1]}   # moves from time 0 to time 1\n"
    "  ignore: [[left, floor]]    # placements or groups\n"
    "  ask: {separation: true, clearance: 0.01}\n"
    "A pose is [x, y, z], [w, x, y, z, x, y, z] with a quaternion first, {xyz: ..., rpy: ...}, or\n"
    "{xyz: ..., quaternion: ...}. A radius grows a piece or a placement by a ball: a point becomes "
    "a\n"
    "sphere, a segment a capsule. ask takes pairs: [[a, b]] or movers: [a], and the options of\n"
    "'hullctl check': separation, witness, normal, axis, certificate, analysis, clearance,\n"
    "max_error, tolerance. `scale` converts coordinates of files to meters, rounded once.\n"
    "Relative file names start at the folder of the scene file.\n";

std::string ChangeJson(const ServerObject& kept, const char* what) {
  return JsonObject().Add(kept.is_body ? "bodyId" : "hullId", kept.id).Add("change", what).Close();
}

// If the item was listed, deletes only the listed revision.
absl::StatusOr<v1::ResponseHeader> DeleteServerObject(const Client& client,
                                                      const ServerObject& kept) {
  if (kept.is_body) {
    const auto deleted = client.DeleteBody(kept.id, kept.revision);
    return deleted.ok() ? deleted->header() : absl::StatusOr<v1::ResponseHeader>(deleted.status());
  }
  const auto deleted = client.DeleteHull(kept.id, kept.revision);
  return deleted.ok() ? deleted->header() : absl::StatusOr<v1::ResponseHeader>(deleted.status());
}

// Returns OK if the user confirms the deletion at the terminal, or if `targets` is empty.
// INVALID_ARGUMENT: no terminal, or the answer was no; `unless` describes the consequence.
absl::Status Confirm(const Invocation& run, const std::vector<ServerObject>& targets,
                     const std::string& unless) {
  if (targets.empty()) return absl::OkStatus();
  std::vector<std::string> ids;
  ids.reserve(targets.size());
  for (const ServerObject& kept : targets) ids.push_back(kept.id);
  const bool has_body = targets.front().is_body;
  const bool has_hull = !targets.back().is_body;
  const auto confirmed = ConfirmDeletion(run, ids, has_body ? "body" : "hull",
                                         has_body && has_hull ? "bodies and hulls"
                                         : has_body           ? "bodies"
                                                              : "hulls");
  if (!confirmed.ok()) return confirmed.status();
  return *confirmed ? absl::OkStatus() : absl::InvalidArgumentError(unless);
}

struct SyncArguments {
  std::string file;
  bool dry_run = false;
  bool prune = false;
  bool yes = false;
};

// Compares the whole scene before the first change, so that an error in the file or in a file that
// it names changes nothing. Then processes it hull by hull, and body by body, so that an
// interrupted run can be continued, and the hulls of a body exist before it.
class SceneSync {
 public:
  SceneSync(const Invocation& run, const SceneDescription& scene)
      : run_(run), scene_(scene), client_(run.MakeClient()) {}

  // Prints the differences, and applies them if `changes`. `prune`: deletes unlisted objects (see
  // UnlistedObjects), after a confirmation unless `yes`. Unlisted objects that appear or change
  // during the run are kept.
  ExitCode Run(bool changes, bool prune, bool yes) {
    std::vector<Change> hulls;
    for (const HullDefinition& hull : scene_.hulls) {
      HULLD_ASSIGN_OR_FAIL(run_.FailUsage, const auto xyz, PointsOf(hull));
      HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto change, Compare(client_, hull.hull_id, xyz));
      hulls.push_back(change);
    }
    std::vector<Change> bodies;
    for (const BodyDefinition& body : scene_.bodies) {
      HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto change, CompareBody(client_, body));
      bodies.push_back(change);
    }
    HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto unlisted, UnlistedObjects(client_, scene_));
    if (prune && changes && !yes) {
      const absl::Status confirmed = Confirm(run_, unlisted, "cancelled; nothing was changed");
      if (!confirmed.ok()) return run_.FailUsage(confirmed);
    }
    for (size_t i = 0; i < hulls.size(); ++i) {
      const HullDefinition& hull = scene_.hulls[i];
      const absl::Status taken = Take({hull.hull_id, false, {}}, hulls[i], changes, [&] {
        const auto xyz = PointsOf(hull);
        return xyz.ok() ? client_.PutHull(hull.hull_id, *xyz) : xyz.status();
      });
      if (!taken.ok()) return run_.Fail(taken);
    }
    for (size_t i = 0; i < bodies.size(); ++i) {
      const BodyDefinition& body = scene_.bodies[i];
      const absl::Status taken = Take({body.body_id, true, {}}, bodies[i], changes,
                                      [&] { return client_.PutBody(BodyRequest(body)).status(); });
      if (!taken.ok()) return run_.Fail(taken);
    }
    const absl::Status listed = HandleUnlisted(unlisted, changes, prune);
    if (!listed.ok()) return run_.Fail(listed);
    if (!run_.json() && !run_.names()) {
      run_.out << "# " << Counted(same_hulls_, "hull");
      if (!scene_.bodies.empty()) run_.out << " and " << Counted(same_bodies_, "body", "bodies");
      run_.out << " unchanged\n";
    }
    return ExitCode::kDone;
  }

  bool found_differences() const { return differences_ > 0; }

 private:
  template <typename Put>
  absl::Status Take(const ServerObject& kept, Change change, bool changes, const Put& put) {
    if (change == Change::kNone) {
      ++(kept.is_body ? same_bodies_ : same_hulls_);
      return absl::OkStatus();
    }
    if (changes) {
      if (absl::Status done = put(); !done.ok()) return done;
    }
    const bool is_new = change == Change::kCreate;
    PrintChange(
        is_new ? "+" : "~", kept,
        changes ? (is_new ? "created" : "replaced") : (is_new ? "to create" : "to replace"));
    return absl::OkStatus();
  }

  absl::Status HandleUnlisted(const std::vector<ServerObject>& unlisted, bool changes, bool prune) {
    for (const ServerObject& object : unlisted) {
      if (prune && changes) {
        const absl::Status deleted = DeleteServerObject(client_, object).status();
        if (!deleted.ok() && !absl::IsNotFound(deleted)) return deleted;
      }
      PrintChange(prune ? "-" : "?", object,
                  !prune    ? "not in the file"
                  : changes ? "deleted"
                            : "to delete");
    }
    return absl::OkStatus();
  }

  void PrintChange(const char* mark, const ServerObject& kept, const char* what) {
    ++differences_;
    if (!run_.PrintForPrograms(ChangeJson(kept, what), kept.id)) {
      run_.out << mark << " " << kept.id << "\t" << (kept.is_body ? "body " : "") << what << "\n";
    }
    run_.out << std::flush;
  }

  const Invocation& run_;
  const SceneDescription& scene_;
  const Client client_;
  uint64_t same_hulls_ = 0;
  uint64_t same_bodies_ = 0;
  uint64_t differences_ = 0;
};

ExitCode ApplyScene(const Invocation& run, const SyncArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto scene, ReadYamlScene(arguments.file));
  if (arguments.prune && !OwnsItsPrefix(scene)) {
    return run.FailUsage(absl::StrCat(arguments.file,
                                      ": --prune needs a prefix that ends in \"/\", such as ",
                                      scene.prefix.empty() ? "cell-3" : scene.prefix,
                                      "/; \"cell-3\" would also match cell-30/arm"));
  }
  return SceneSync(run, scene).Run(!arguments.dry_run, arguments.prune, arguments.yes);
}

ExitCode DiffScene(const Invocation& run, const SyncArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto scene, ReadYamlScene(arguments.file));
  SceneSync sync(run, scene);
  const ExitCode code = sync.Run(/*changes=*/false, /*prune=*/false, /*yes=*/false);
  if (code != ExitCode::kDone) return code;
  return sync.found_differences() ? ExitCode::kRequestFailed : ExitCode::kDone;
}

// Returns the scene's definitions that exist on the server, bodies before their hulls.
absl::StatusOr<std::vector<ServerObject>> DefinedAndThere(const Client& client,
                                                          const SceneDescription& scene) {
  std::vector<ServerObject> kept;
  const auto take = [&kept](const std::string& id, bool is_body, const absl::Status& found) {
    // Damaged hulls and bodies can be deleted.
    if (found.ok() || absl::IsDataLoss(found)) kept.push_back({id, is_body, std::nullopt});
    return absl::IsNotFound(found) || absl::IsDataLoss(found) ? absl::OkStatus() : found;
  };
  for (const BodyDefinition& body : scene.bodies) {
    const absl::Status found = client.GetBody(body.body_id).status();
    if (absl::Status taken = take(body.body_id, true, found); !taken.ok()) return taken;
  }
  for (const HullDefinition& hull : scene.hulls) {
    const absl::Status found = client.GetHull(hull.hull_id).status();
    if (absl::Status taken = take(hull.hull_id, false, found); !taken.ok()) return taken;
  }
  return kept;
}

ExitCode DeleteScene(const Invocation& run, const SyncArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto scene, ReadYamlScene(arguments.file));
  const Client client = run.MakeClient();
  HULLD_ASSIGN_OR_FAIL(run.Fail, const auto targets, DefinedAndThere(client, scene));
  if (targets.empty()) {
    if (!run.json() && !run.names()) run.out << "# none of the file's hulls and bodies exist\n";
    return ExitCode::kDone;
  }
  if (!arguments.yes && targets.size() > 1) {
    const absl::Status confirmed = Confirm(run, targets, "nothing was deleted");
    if (!confirmed.ok()) return run.FailUsage(confirmed);
  }
  for (const ServerObject& kept : targets) {
    const auto header = DeleteServerObject(client, kept);
    if (absl::IsNotFound(header.status())) continue;
    if (!header.ok()) return run.Fail(header.status());
    if (!run.PrintForPrograms(ChangeJson(kept, "deleted"), kept.id)) {
      run.out << kept.id << " deleted at revision " << header->revision() << "\n";
    }
  }
  return ExitCode::kDone;
}

}  // namespace

void AddSceneSyncCommands(Command scene, Invocation* invocation) {
  struct Declared {
    const char* name;
    const char* help;
    ExitCode (*act)(const Invocation&, const SyncArguments&);
    const char* details;
    const char* example;
  };
  const Declared commands[] = {
      {"apply", "Create and update the hulls and bodies of a scene file", ApplyScene,
       "Creates and replaces hulls, then bodies, one after another, each atomically. Skips "
       "unchanged\n"
       "ones. A hull is unchanged if it contains each point of the file and each of its vertices "
       "is\n"
       "one of these points, in exact arithmetic. The command can be repeated, for example after "
       "an\n"
       "interruption.\n"
       "If the prefix ends with /, hulls and bodies under it that are not in the file are listed "
       "(?),\n"
       "and --prune deletes them after a confirmation. Those that have changed since they were "
       "listed\n"
       "are kept, and the exit code is 1.\n",
       "hullctl scene apply cell.yaml --dry-run"},
      {"diff", "Show differences between the server and a scene file", DiffScene,
       "Prints what 'hullctl scene apply' would do, without changes. Exits with 1 if there are\n"
       "differences.\n",
       "hullctl scene diff cell.yaml"},
      {"delete", "Delete the hulls and bodies that a scene file defines", DeleteScene,
       "Deletes bodies before their hulls, after a confirmation as in 'hullctl delete'. "
       "Placements\n"
       "by id are kept.\n",
       "hullctl scene delete cell.yaml --yes"},
  };
  for (const Declared& declared : commands) {
    auto arguments = std::make_shared<SyncArguments>();
    Command command = scene.AddCommand(declared.name, declared.help);
    command.AddText("FILE", &arguments->file, "The scene, in YAML; - is standard input").Required();
    if (declared.act == ApplyScene) {
      command.AddFlag("--dry-run", &arguments->dry_run, "Print the changes without making them");
      command.AddFlag("--prune", &arguments->prune,
                      "Delete hulls and bodies under the prefix that are not in the file");
    }
    if (declared.act != DiffScene) {
      command.AddFlag("--yes", &arguments->yes, "Delete without confirmation");
    }
    command.SetDetails(absl::StrCat(declared.details, "\n", kYamlHelp));
    command.SetExamples({{"", declared.example}});
    OnGiven(command, invocation, arguments, declared.act);
  }
}

}  // namespace hulld
