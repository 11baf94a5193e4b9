#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/local/file_shape.h"
#include "client/hullctl/local/local_server.h"
#include "client/hullctl/robot/robot_scene.h"
#include "client/hullctl/scene/recorded_watch.h"
#include "client/hullctl/scene/scene_sync.h"
#include "client/hullctl/view/bridge/bridge.h"
#include "client/hullctl/view/bridge/page_html.h"
#include "client/hullctl/view/browser_picture.h"
#include "client/hullctl/view/demo_scenes.h"
#include "client/hullctl/view/page_session.h"
#include "client/hullctl/view/recording.h"
#include "client/hullctl/view/temporary_hulls.h"

namespace hulld {
namespace {

struct ViewArguments {
  std::vector<std::string> things;
  bool demo = false;
  // A key of --demo, or the file of the surroundings of a robot.
  std::string scene;
  uint16_t port = 0;
  bool no_open = false;
  // A recorded watch.
  std::string recording;
  std::string html_file;
  std::string png_file;
  PictureSize size;
  // Empty: chosen by Up.
  std::string up;
  // Options of the robot, if a robot is shown.
  RobotSceneArguments robot;
};

// Returns true if the argument is the file of a robot.
bool IsRobot(const std::string& argument) {
  return (argument.ends_with(".urdf") || argument.ends_with(".xml")) && IsFile(argument);
}

// Returns true if the argument is a scene rather than a mesh or points.
bool IsScene(const std::string& argument) {
  return IsFile(argument) && !IsRobot(argument) && IsSceneFile(argument);
}

// Returns the axis that points up: z for a robot, as in ROS; otherwise y, as in glTF.
std::string Up(const ViewArguments& arguments) {
  if (!arguments.up.empty()) return arguments.up;
  return std::ranges::any_of(arguments.things, IsRobot) ? "z" : "y";
}

// A file, readable only by this user, that redirects a browser to the address. Other users can see
// program arguments, so the address must not be one.
class AddressFile {
 public:
  explicit AddressFile(const std::string& address) {
    const char* const runtime = getenv("XDG_RUNTIME_DIR");
    std::string pattern =
        absl::StrCat(runtime != nullptr ? runtime : "/tmp", "/hullctl-view-XXXXXX.html");
    const int file = mkstemps(pattern.data(), 5);
    if (file < 0) return;
    const std::string page = absl::StrCat(
        "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0; url=",
        address, "\"><title>hulld</title>");
    if (write(file, page.data(), page.size()) == static_cast<ssize_t>(page.size())) path_ = pattern;
    close(file);
  }
  ~AddressFile() {
    if (!path_.empty()) unlink(path_.c_str());
  }
  AddressFile(const AddressFile&) = delete;
  AddressFile& operator=(const AddressFile&) = delete;

  // Empty if it could not be written.
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Returns true if a browser was asked to open the file.
bool OpenInBrowser(const std::string& path) {
  if (path.empty()) return false;
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&quiet, stream, "/dev/null", O_WRONLY, 0);
  }
  std::string program = "xdg-open";
  std::string argument = path;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, program.c_str(), &quiet, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&quiet);
  return failed == 0;
}

// The scenes of `view`, with the temporary hulls made for them.
class Viewing {
 public:
  Viewing(const Invocation& run, const ViewArguments& arguments)
      : run_(run),
        arguments_(arguments),
        program_{run.MakeClient(), run.server, Up(arguments), {}, {}},
        temporary_(program_.client) {}

  ExitCode Run() {
    const ExitCode loaded = arguments_.demo ? LoadDemo() : LoadThings();
    if (loaded != ExitCode::kDone) return loaded;
    if (!arguments_.html_file.empty()) return WriteHtml();
    return arguments_.png_file.empty() ? Serve() : WritePng();
  }

 private:
  ExitCode LoadDemo() {
    HULLD_ASSIGN_OR_FAIL(run_.Fail, program_.scenes, MakeDemoScenes(program_.client, &temporary_));
    const ViewScene& last = program_.scenes.back();
    growing_ = std::make_unique<GrowingHull>(program_.client, last.objects[kGrowingObject].hull_id);
    program_.on_show = [this](const std::string& key) {
      if (key == kGrowingSceneKey) growing_->Restart();
    };
    // Pages start with the first scene.
    if (!arguments_.scene.empty()) {
      const size_t chosen = static_cast<size_t>(arguments_.scene[0] - '0');
      std::rotate(program_.scenes.begin(), program_.scenes.begin() + chosen,
                  program_.scenes.begin() + chosen + 1);
    }
    return ExitCode::kDone;
  }

  ExitCode LoadThings() {
    ViewScene scene;
    std::vector<std::string> things = arguments_.things;
    scene.title = things.empty()      ? "All hulls and bodies"
                  : IsFile(things[0]) ? ShownName(things[0])
                                      : things[0];
    if (things.size() > 1) absl::StrAppend(&scene.title, " and ", things.size() - 1, " more");
    if (things.empty()) things.emplace_back();
    for (const std::string& thing : things) {
      if (IsRobot(thing) || IsScene(thing)) {
        if (things.size() > 1) {
          return run_.FailUsage(absl::StrCat(thing, " is a ", IsRobot(thing) ? "robot" : "scene",
                                             "; it cannot be combined with other arguments"));
        }
        const absl::Status added = IsRobot(thing) ? AddTheRobot(&scene) : AddTheScene(&scene);
        if (!added.ok()) return run_.FailUsage(added);
      } else if (IsFile(thing)) {
        const absl::Status added = AddFile(thing, &scene);
        if (!added.ok()) return run_.FailUsage(added);
      } else {
        const absl::Status added = AddHullsAndBodies(program_.client, thing, &scene);
        if (!added.ok()) return run_.Fail(added);
      }
    }
    if (!arguments_.recording.empty()) {
      const absl::Status added = AddTheRecording(&scene);
      if (!added.ok()) return run_.FailUsage(added);
    }
    program_.scenes.push_back(std::move(scene));
    return ExitCode::kDone;
  }

  absl::Status AddTheRecording(ViewScene* scene) {
    const std::string& path = arguments_.recording;
    HULLD_ASSIGN_OR_RETURN(auto watch, ReadRecordedWatch(path));
    const std::vector<std::string>& things = arguments_.things;
    if (watch.is_of_pairs != (things.size() == 1 && IsScene(things[0]))) {
      return absl::InvalidArgumentError(absl::StrCat(
          path, watch.is_of_pairs
                    ? " records a watch of a scene; pass the scene file that was watched"
                    : " records a watch of hulls; pass their IDs or prefix, or no argument"));
    }
    if (watch.is_of_pairs && watch.placements > scene->objects.size()) {
      return absl::InvalidArgumentError(absl::StrCat(
          path, " records a watch of another scene: it contains placement ", watch.placements - 1,
          ", counted from 0, but ", things[0], " has only ", scene->objects.size()));
    }
    scene->watch = std::move(watch.messages);
    scene->note = absl::StrCat("A recorded watch: the timeline shows the ",
                               watch.is_of_pairs ? "pairs that collided" : "hulls that existed",
                               ". Shapes and answers are current.");
    return absl::OkStatus();
  }

  absl::Status AddTheRobot(ViewScene* scene) {
    RobotSceneArguments robot = arguments_.robot;
    robot.robot.urdf = arguments_.things[0];
    robot.scene = arguments_.scene;
    HULLD_RETURN_IF_ERROR(PutSceneIfLocal(run_, robot.scene));
    return AddRobot(robot, program_.client, &temporary_, scene);
  }

  absl::Status AddTheScene(ViewScene* scene) {
    const std::string& path = arguments_.things[0];
    const absl::Status put = PutSceneIfLocal(run_, path);
    return put.ok() ? AddSceneFile(path, scene) : put;
  }

  // Reads the shape from the file. With --local, the hull is registered on the local server; any
  // other server receives its vertices with each query.
  absl::Status AddFile(const std::string& path, ViewScene* scene) {
    HULLD_ASSIGN_OR_RETURN(auto shape, ReadShape(path));
    ViewObject object{shape.name, "", static_cast<int>(scene->files.size()), kNoMotion};
    const absl::Status hull = run_.local ? RegisterHull(path, &object) : BuildHull(path, &shape);
    if (!hull.ok()) {
      run_.err << "hullctl: warning: " << path << " is shown without its hull\n";
      static_cast<void>(run_.FailUsage(hull));
    }
    if (shape.hull != nullptr) {
      object.hull_id = shape.hull_name;
      object.hull = shape.hull;
    }
    scene->objects.push_back(std::move(object));
    scene->files.push_back(std::make_shared<FileShape>(std::move(shape)));
    return absl::OkStatus();
  }

  absl::Status RegisterHull(const std::string& path, ViewObject* object) {
    const auto id = temporary_.AddFile(path);
    if (id.ok()) object->hull_id = *id;
    return id.status();
  }

  static absl::Status BuildHull(const std::string& path, FileShape* shape) {
    HULLD_ASSIGN_OR_RETURN(auto hull, HullOfFile(path));
    if (hull.vertex_count() > kMaxShapePoints) {
      return absl::InvalidArgumentError(absl::StrCat("its hull has ", hull.vertex_count(),
                                                     " vertices, but a query can carry at most ",
                                                     kMaxShapePoints, "; use --local"));
    }
    shape->hull = std::make_shared<const HullMesh>(std::move(hull));
    // In the form accepted by `hullctl check`.
    const bool is_path = path.starts_with('.') || path.starts_with('/');
    shape->hull_name = Printable(absl::StrCat(is_path ? "" : "./", path));
    return absl::OkStatus();
  }

  ExitCode WriteHtml() {
    HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto recording,
                         RecordScene(program_, program_.scenes.front()));
    const size_t count = program_.scenes.front().objects.size();
    return Write(arguments_.html_file, StandalonePage(recording),
                 absl::StrCat(Counted(count, "object"), "; open it in a browser"));
  }

  ExitCode WritePng() {
    HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto recording,
                         RecordScene(program_, program_.scenes.front()));
    HULLD_ASSIGN_OR_FAIL(run_.Fail, const auto picture,
                         PictureOf(PicturePage(recording, arguments_.size)));
    return Write(arguments_.png_file, picture,
                 absl::StrCat(arguments_.size.width, " by ", arguments_.size.height, " pixels"));
  }

  // Writes a file of the scene and reports its content, unless it is standard output.
  ExitCode Write(const std::string& file, const std::string& bytes, const std::string& content) {
    const ExitCode written = run_.WriteFile(file, [&](std::ostream& out) { out << bytes; });
    if (written == ExitCode::kDone && file != "-") {
      run_.out << file << ": " << content << "\n";
    }
    return written;
  }

  ExitCode Serve() {
    BridgeOptions options;
    options.port = arguments_.port;
    options.open_page = [this](std::shared_ptr<PageChannel> page) {
      return std::make_unique<PageSession>(program_, std::move(page));
    };
    HULLD_ASSIGN_OR_FAIL(run_.FailUsage, const auto bridge, Bridge::Start(std::move(options)));
    run_.out << "viewer at " << bridge->Address() << "\n"
             << "the address works once, in one browser; Ctrl-C ends the viewer" << std::endl;
    std::unique_ptr<AddressFile> address;
    if (!arguments_.no_open && isatty(STDOUT_FILENO) != 0) {
      address = std::make_unique<AddressFile>(bridge->Address());
      OpenInBrowser(address->path());
    }
    interrupted_.wait(false);
    return ExitCode::kDone;
  }

  const Invocation& run_;
  const ViewArguments& arguments_;
  // Handles signals until the end, so that temporary hulls are removed. Declared before everything
  // that starts threads.
  std::atomic_flag interrupted_;
  const Interrupt interrupt_{[this] {
    interrupted_.test_and_set();
    interrupted_.notify_all();
  }};
  ViewProgram program_;
  TemporaryHulls temporary_;
  std::unique_ptr<GrowingHull> growing_;
};

ExitCode View(const Invocation& run, const ViewArguments& arguments) {
  if (arguments.demo && !arguments.things.empty()) {
    return run.FailUsage("--demo shows its own scenes; remove " + arguments.things[0]);
  }
  const bool is_robot = arguments.things.size() == 1 && IsRobot(arguments.things[0]);
  if (!is_robot && !(arguments.robot.joints.empty() && arguments.robot.srdf.empty() &&
                     arguments.robot.ignored.empty() && arguments.robot.robot.packages.empty())) {
    return run.FailUsage(
        "--joints, --srdf, --ignore, and --package apply to a robot; pass one .urdf file");
  }
  const std::string& scene = arguments.scene;
  if (!scene.empty() && !arguments.demo && !is_robot) {
    return run.FailUsage(
        "--scene needs --demo, or a robot to place in the scene; pass one .urdf file");
  }
  if (!scene.empty() && arguments.demo && (scene.size() != 1 || scene[0] < '0' || scene[0] > '7')) {
    return run.FailUsage(
        absl::StrCat("--scene: ", Quoted(scene), " is not a demo scene; pass a key from 0 to 7"));
  }
  if (!arguments.recording.empty() && (arguments.demo || is_robot)) {
    return run.FailUsage("--recording cannot be combined with --demo or a robot");
  }
  const int files = !arguments.html_file.empty() + !arguments.png_file.empty();
  if (files == 2) {
    return run.FailUsage("--html and --png cannot be combined");
  }
  const bool is_temporary =
      arguments.demo || (!arguments.things.empty() && scene.empty() &&
                         std::ranges::all_of(arguments.things, [](const std::string& thing) {
                           return IsFile(thing) && !IsScene(thing);
                         }));
  if (!is_temporary || run.local) return Viewing(run, arguments).Run();
  // All hulls are temporary: a private server stores them.
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const auto server, LocalServer::Start());
  Invocation local = run;
  local.local = true;
  local.server = server->address();
  local.security = {};
  return Viewing(local, arguments).Run();
}

void AddRobotOptions(Command command, RobotSceneArguments* robot) {
  command.AddText("--joints", &robot->joints, "Trajectory of a robot, as for 'hullctl robot check'")
      .ValueName("FILE");
  command
      .AddText("--srdf", &robot->srdf,
               "Exclude exactly the pairs of links that this semantic description disables")
      .ValueName("FILE");
  command
      .AddRepeated("--ignore", &robot->ignored,
                   "Exclude two links, or a link and a placement; repeatable")
      .ValueName("NAME,NAME");
  command.AddRepeated("--package", &robot->robot.packages, "Folder of a package; repeatable")
      .ValueName("NAME=DIR");
}

}  // namespace

void AddViewCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<ViewArguments>();
  Command command = program.AddCommand("view", "Show hulls, bodies, and files in a browser");
  command
      .AddTexts("ID|PREFIX|FILE", &arguments->things,
                "IDs or prefixes of hulls and bodies, meshes, points, a scene, or a robot "
                "(.urdf); default: all hulls and bodies")
      .Completes(ValueKind::kShape);
  command.AddFlag("--demo", &arguments->demo,
                  "Show the demo scenes, keys 0 to 7, with temporary hulls");
  command
      .AddText("--scene", &arguments->scene,
               "Scene around a robot, as for 'hullctl robot check'; or the first scene of --demo, "
               "0 to 7")
      .ValueName("FILE");
  command.AddNumber("--port", 0, 65535, "Port on 127.0.0.1 (default 0: any free one)",
                    &arguments->port);
  command.AddFlag("--no-open", &arguments->no_open, "Print the address and open no browser");
  command
      .AddText("--html", &arguments->html_file,
               "Write one file that shows the scene without a server, and exit")
      .ValueName("FILE");
  command
      .AddText("--png", &arguments->png_file,
               "Write a picture, drawn by a headless browser, and exit")
      .ValueName("FILE");
  command
      .AddParsed("--size", ParsePictureSize, &arguments->size,
                 "Pixels of --png (default 1600x1000)")
      .ValueName("WIDTHxHEIGHT");
  command
      .AddText("--recording", &arguments->recording,
               "Play a recorded watch: the output of 'hullctl watch --output json'")
      .ValueName("FILE");
  AddRobotOptions(command, &arguments->robot);
  command.AddText("--up", &arguments->up, "The axis that points up (default z for a robot, else y)")
      .ValueName("x|y|z")
      .OneOf({"x", "y", "z"});
  command.SetDetails(
      "A body is dragged as a whole; the hulls of its pieces are shown on their own only if\n"
      "named. The page queries hulld through hullctl: it never sees your token, and cannot change\n"
      "the server. Files alone and --demo need no server: hullctl starts a private one, which\n"
      "ends with the viewer. Files shown next to hulls of a server are not stored there: each\n"
      "query carries the vertices of their hulls, at most 4096. Press ? on the page to list its\n"
      "keys. --png runs chromium or another browser that is based on it.\n"
      "\n"
      "A scene is YAML or JSON, as for 'hullctl scene'; --local also creates its hulls and\n"
      "bodies. If placements move ('to'), a slider plays the motion and marks the first contact\n"
      "of the selected pair. A robot has a slider for each joint and, with --joints, a timeline\n"
      "that marks the waypoints in contact. Its pairs are those of 'hullctl robot check'. With\n"
      "--scene, they include pairs of a part and a placement of that file, whose hulls must be on\n"
      "the server unless --local creates them.\n"
      "\n"
      "--recording adds a timeline to the scene that 'hullctl watch --scene' watched: it shows\n"
      "the pairs that collided at each moment. With the output of 'hullctl watch PREFIX', it\n"
      "shows which hulls existed.");
  command.SetExamples(
      {{"All hulls of the server", "hullctl view"},
       {"All hulls with a prefix, including new ones", "hullctl view cell-3/"},
       {"A hull, and the points, mesh, and hull of a file", "hullctl view arm part.stl"},
       {"A scene", "hullctl view scene.json"},
       {"A robot along a trajectory", "hullctl view arm.urdf --joints path.csv"},
       {"A robot in its cell", "hullctl view arm.urdf --scene cell.yaml --ignore base,floor"},
       {"The collisions of a scene over time", "hullctl view scene.yaml --recording watch.jsonl"},
       {"A file to share", "hullctl view arm --html arm.html"},
       {"A picture for a report", "hullctl view scene.yaml --png scene.png --size 1200x800"}});
  OnGiven(command, invocation, arguments, View);
}

}  // namespace hulld
