#include "client/hullctl/scene/scene_commands.h"

#include <absl/strings/str_cat.h>

#include <memory>

#include "client/formats/text_number.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/scene/scene_sync.h"
#include "client/hullctl/scene/yaml_scene.h"

namespace hulld {
namespace {

constexpr char kYamlHelp[] =
    "A scene in YAML:\n"
    "  prefix: cell-3/            # in front of the names of hulls, on the server\n"
    "  scale: mm                  # of files that say none: mm, cm, m, in, ft or a factor\n"
    "  hulls:\n"
    "    bracket: {file: bracket.stl, scale: cm}    # the hull of the file's points\n"
    "    table: {box: [2, 1, 0.1]}                  # edges; it stands around the origin\n"
    "    wedge: {points: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"
    "  bodies:                    # hulls that stand together\n"
    "    corner:\n"
    "      - {hull: bracket}\n"
    "      - {hull: wedge, at: [0, 0, 0.1]}\n"
    "  place:                     # each thing at a pose; members of a group do not collide\n"
    "    floor: {hull: table, at: [0, 0, -0.05], group: building}\n"
    "    left: {body: corner, at: {xyz: [1, 0, 0], rpy: [0, 0, 1.57]}}\n"
    "    arm: {id: arm/upper}     # a hull that is on the server anyway\n"
    "  ignore: [[left, floor]]    # placements or groups\n"
    "  ask: {separation: true, clearance: 0.01}\n"
    "A pose is [x, y, z], or [w, x, y, z, x, y, z] with a quaternion in front, or {xyz: ..., rpy: "
    "...}\n"
    "or {xyz: ..., quaternion: ...}. ask takes pairs: [[a, b]] or movers: [a], and what 'hullctl\n"
    "check' asks for: separation, witness, axis, certificate, analysis, clearance, max_error,\n"
    "tolerance. Coordinates of files become metres by `scale`, rounded once. Files stand beside\n"
    "the scene file. Bodies are placed piece by piece, as NAME/PIECE.\n";

struct SyncArguments {
  std::string file;
  bool dry_run = false;
  bool prune = false;
  bool yes = false;
};

// Goes through a scene hull by hull, so that a run that ended early goes on where it was.
class SceneSync {
 public:
  SceneSync(const Invocation& run, const SceneDescription& scene)
      : run_(run), scene_(scene), client_(run.MakeClient()) {}

  // Tells what differs, and changes it where `changes` says so. `prune`: removes strangers.
  ExitCode Run(bool changes, bool prune) {
    for (const HullDefinition& hull : scene_.hulls) {
      const auto xyz = PointsOf(hull);
      if (!xyz.ok()) return run_.FailUsage(xyz.status());
      const auto change = Compare(client_, hull.hull_id, *xyz);
      if (!change.ok()) return run_.Fail(change.status());
      if (*change == HullChange::kNone) {
        ++same_;
        continue;
      }
      if (changes) {
        if (absl::Status put = PutHull(client_, hull.hull_id, *xyz); !put.ok()) {
          return run_.Fail(put);
        }
      }
      const bool is_new = *change == HullChange::kCreate;
      Tell(is_new ? "+" : "~", hull.hull_id,
           changes ? (is_new ? "created" : "replaced") : (is_new ? "to create" : "to replace"));
    }
    const auto strangers = Strangers(client_, scene_);
    if (!strangers.ok()) return run_.Fail(strangers.status());
    for (const std::string& id : *strangers) {
      if (prune && changes) {
        const auto deleted = client_.DeleteHull(id);
        if (!deleted.ok() && !absl::IsNotFound(deleted.status()))
          return run_.Fail(deleted.status());
      }
      Tell(prune ? "-" : "?", id, !prune ? "not in the file" : changes ? "deleted" : "to delete");
    }
    if (!run_.json() && !run_.names())
      run_.out << "# " << same_ << " hulls are as the file has them\n";
    return ExitCode::kDone;
  }

  bool found_differences() const { return differences_ > 0; }

 private:
  void Tell(const char* mark, const std::string& id, const char* what) {
    ++differences_;
    if (run_.json()) {
      run_.out << JsonObject().Add("hullId", id).Add("change", what).Close() << "\n";
    } else if (run_.names()) {
      run_.out << id << "\n";
    } else {
      run_.out << mark << " " << id << "\t" << what << "\n";
    }
    run_.out << std::flush;
  }

  const Invocation& run_;
  const SceneDescription& scene_;
  const Client client_;
  uint64_t same_ = 0;
  uint64_t differences_ = 0;
};

ExitCode ApplyScene(const Invocation& run, const SyncArguments& arguments) {
  const auto scene = ReadYamlScene(arguments.file);
  if (!scene.ok()) return run.FailUsage(scene.status());
  return SceneSync(run, *scene).Run(!arguments.dry_run, arguments.prune);
}

ExitCode DiffScene(const Invocation& run, const SyncArguments& arguments) {
  const auto scene = ReadYamlScene(arguments.file);
  if (!scene.ok()) return run.FailUsage(scene.status());
  SceneSync sync(run, *scene);
  const ExitCode code = sync.Run(/*changes=*/false, /*prune=*/false);
  if (code != ExitCode::kDone) return code;
  return sync.found_differences() ? ExitCode::kRequestFailed : ExitCode::kDone;
}

ExitCode DeleteScene(const Invocation& run, const SyncArguments& arguments) {
  const auto scene = ReadYamlScene(arguments.file);
  if (!scene.ok()) return run.FailUsage(scene.status());
  std::vector<std::string> words = {"delete"};
  const Client client = run.MakeClient();
  for (const HullDefinition& hull : scene->hulls) {
    const auto there = client.GetHull(hull.hull_id);
    if (absl::IsNotFound(there.status())) continue;
    if (!there.ok()) return run.Fail(there.status());
    words.push_back(hull.hull_id);
  }
  if (words.size() == 1) {
    if (!run.json() && !run.names()) run.out << "# none of the hulls is there\n";
    return ExitCode::kDone;
  }
  if (arguments.yes) words.emplace_back("--yes");
  return static_cast<ExitCode>(run.run_line(words));
}

}  // namespace

absl::Status RefuseSecondFile(const std::string& scene_file) {
  if (scene_file.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("unexpected argument ", Quoted(scene_file), "; a scene is one file"));
}

void AddSceneSyncCommands(Command scene, const std::string* scene_file, Invocation* invocation) {
  struct Declared {
    const char* name;
    const char* help;
    ExitCode (*act)(const Invocation&, const SyncArguments&);
    const char* details;
    const char* example;
  };
  const Declared commands[] = {
      {"apply", "Make the server's hulls those of a scene file", ApplyScene,
       "Creates and replaces hulls until the server has those of the file, one after another, "
       "each\n"
       "at once for all readers. A hull that is the same is left alone, which exact arithmetic\n"
       "decides: each point is in it, and each vertex is one of the points. So it may be run\n"
       "again, and goes on where it was interrupted. What is under the prefix and not in the file\n"
       "is told (?), and deleted with --prune.\n",
       "hullctl scene apply cell.yaml --dry-run"},
      {"diff", "Tell how the server's hulls differ from a scene file", DiffScene,
       "Prints what 'hullctl scene apply' would do, and changes nothing. Exit code 1 when there "
       "is\n"
       "a difference.\n",
       "hullctl scene diff cell.yaml"},
      {"delete", "Delete the hulls that a scene file defines", DeleteScene,
       "Asks as 'hullctl delete' does. Hulls that the file names by id stay.\n",
       "hullctl scene delete cell.yaml --yes"},
  };
  for (const Declared& declared : commands) {
    auto arguments = std::make_shared<SyncArguments>();
    Command command = scene.AddCommand(declared.name, declared.help);
    command.AddText("FILE", &arguments->file, "The scene, in YAML; - is standard input").Required();
    if (declared.act == ApplyScene) {
      command.AddFlag("--dry-run", &arguments->dry_run, "Say what would change; change nothing");
      command.AddFlag("--prune", &arguments->prune,
                      "Delete hulls under the prefix that the file does not define");
    }
    if (declared.act == DeleteScene) {
      command.AddFlag("--yes", &arguments->yes, "Delete without asking");
    }
    command.SetDetails(absl::StrCat(declared.details, "\n", kYamlHelp));
    command.SetExamples({{"", declared.example}});
    command.OnGiven([=, act = declared.act] {
      invocation->action = [=] {
        const absl::Status alone = RefuseSecondFile(*scene_file);
        return alone.ok() ? act(*invocation, *arguments) : invocation->FailUsage(alone);
      };
    });
  }
}

}  // namespace hulld
