#include <absl/strings/str_cat.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <unordered_map>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/commands/scene_answers.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/printing/table.h"
#include "client/hullctl/scene/scene_sync.h"

namespace hulld {
namespace {

// Prints the pairs of a scene as they arrive.
class SceneRun {
 public:
  SceneRun(const Invocation& run, const Scene& scene)
      : run_(run),
        scene_(scene),
        request_(scene.request),
        bar_(run.err, run.shows_progress, "pairs found", 0) {}

  absl::Status Run() {
    absl::Status status = run_.MakeClient().FindCollisions(
        request_, [this](const v1::FindCollisionsResponse& part) { return Take(part); });
    if (status.ok() && !complete_) {
      status = absl::InternalError("the answers ended without totals");
    }
    bar_.Clear();
    if (status.ok() && !run_.json() && !run_.names()) PrintTotals();
    return status;
  }

  // Number of placements and pairs without an answer.
  uint64_t failed() const { return totals_.failed() + placement_problems_; }

 private:
  absl::Status Take(const v1::FindCollisionsResponse& part) {
    bar_.Clear();
    if (run_.json()) run_.out << MessageJson(part) << "\n";
    for (const v1::PlacementProblem& problem : part.placement_problems()) {
      ++placement_problems_;
      if (scene_.HullOf(problem.placement()) == nullptr) {
        return absl::InternalError("the answer refers to a placement that does not exist");
      }
      run_.err << "hullctl: placement " << scene_.NameOf(problem.placement()) << ": "
               << scene_.ProblemText(problem.placement(), problem) << "\n";
    }
    std::unordered_map<uint64_t, std::string> problems;
    for (const v1::PairProblem& problem : part.columns().pair_problems()) {
      problems[problem.row()] = scene_.InKeys(problem.message());
    }
    const int count = part.pairs_size() / 2;
    if (part.pairs_size() % 2 != 0 || !AreParallel(part.columns(), static_cast<size_t>(count))) {
      return absl::InternalError("the answer's columns and pairs disagree");
    }
    for (int i = 0; i < count; ++i) {
      const auto problem = problems.find(static_cast<uint64_t>(i));
      const std::string* const cause = problem == problems.end() ? nullptr : &problem->second;
      const uint32_t a = part.pairs(2 * i);
      const uint32_t b = part.pairs(2 * i + 1);
      if (scene_.HullOf(a) == nullptr || scene_.HullOf(b) == nullptr) {
        return absl::InternalError("the answer refers to a placement that does not exist");
      }
      if (!run_.json()) PrintPair(run_, scene_, a, b, RowAt(part.columns(), i), cause);
    }
    bar_.Update(found_ += static_cast<uint64_t>(count));
    if (part.has_totals()) {
      totals_ = part.totals();
      complete_ = true;
    }
    return absl::OkStatus();
  }

  void PrintTotals() {
    run_.out << "# touching " << totals_.touching() << " overlapping " << totals_.overlapping();
    if (request_.tolerance() > 0) run_.out << " within_tolerance " << totals_.within_tolerance();
    if (request_.wanted().has_clearance()) run_.out << " separated " << totals_.separated();
    run_.out << " failed " << totals_.failed() << "\n";
  }

  const Invocation& run_;
  const Scene& scene_;
  const v1::FindCollisionsRequest& request_;
  ProgressBar bar_;
  v1::SceneTotals totals_;
  bool complete_ = false;
  uint64_t found_ = 0;
  uint64_t placement_problems_ = 0;
};

struct SceneArguments {
  std::string file;
  QueryDetails details;
  // 0: all pairs.
  uint32_t nearest = 0;
  bool first = false;
  bool every_piece = false;
};

// Options that choose pairs and rows.
void AddChoiceOptions(Command command, SceneArguments* arguments) {
  command
      .AddNumber("--nearest", 1, std::numeric_limits<uint32_t>::max(),
                 "Find only the N pairs with the smallest separation, nearest first, within "
                 "--clearance if it is given; implies --separation",
                 &arguments->nearest)
      .ValueName("N");
  command.AddFlag("--first", &arguments->first,
                  "Of pairs in motion, find only those that may be the first to touch");
  command.AddFlag("--every-piece", &arguments->every_piece,
                  "Print a row for every pair of pieces found, not only for the deciding pair");
}

// Makes a scene find its nearest pairs.
void SetNearest(uint32_t count, v1::FindCollisionsRequest* request) {
  request->set_limit(count);
  v1::Wanted* const wanted = request->mutable_wanted();
  wanted->set_separation(true);
  if (!wanted->has_clearance()) wanted->set_clearance(std::numeric_limits<double>::infinity());
}

ExitCode Find(const Invocation& run, const SceneArguments& arguments, Scene* read) {
  arguments.details.Apply(&read->request);
  if (arguments.nearest > 0) SetNearest(arguments.nearest, &read->request);
  if (arguments.first) read->request.set_first_only(true);
  if (arguments.every_piece) read->request.set_every_piece(true);
  SceneRun scene(run, *read);
  if (absl::Status status = scene.Run(); !status.ok()) return run.Fail(read->InKeys(status));
  if (scene.failed() == 0) return ExitCode::kDone;
  run.err << "hullctl: " << Counted(scene.failed(), "placement or pair", "placements or pairs")
          << " failed\n";
  return ExitCode::kSomeFailed;
}

ExitCode FindInScene(const Invocation& run, const SceneArguments& arguments) {
  if (arguments.file.empty()) {
    return run.FailUsage(
        "FILE is required: 'hullctl scene FILE', or 'hullctl scene apply|check|diff|delete FILE'");
  }
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto read,
                       ReadWholeScene(arguments.file, "scene", FormFor(arguments.details)));
  if (auto put = PutSceneIfLocal(run, arguments.file); !put.ok()) return run.Fail(put);
  if (read.pairs.has_value()) {
    return run.FailUsage(
        absl::StrCat(arguments.file,
                     ": 'hullctl scene FILE' finds pairs itself, but the file names pairs; use "
                     "'hullctl scene check' or 'hullctl batch', or remove the pairs"));
  }
  return Find(run, arguments, &read);
}

ExitCode CheckScene(const Invocation& run, const SceneArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto read,
                       ReadWholeScene(arguments.file, "scene", FormFor(arguments.details)));
  if (auto put = PutSceneIfLocal(run, arguments.file); !put.ok()) return run.Fail(put);
  if (read.pairs.has_value()) {
    const char* const option = arguments.nearest > 0   ? "--nearest"
                               : arguments.first       ? "--first"
                               : arguments.every_piece ? "--every-piece"
                                                       : nullptr;
    if (option != nullptr) {
      return run.FailUsage(absl::StrCat(
          arguments.file, ": ", option,
          " finds pairs itself, but the file names pairs; remove the option or the pairs"));
    }
    return AnswerPairs(run, arguments.file, read, arguments.details, /*colliding=*/false);
  }
  return Find(run, arguments, &read);
}

void AddCheck(Command scene, Invocation* invocation) {
  auto arguments = std::make_shared<SceneArguments>();
  Command command = scene.AddCommand("check", "Answer the queries of a scene file");
  command.AddText("FILE", &arguments->file, "The scene; - is standard input").Required();
  AddWantedOptions(command, &arguments->details);
  AddChoiceOptions(command, arguments.get());
  AddFreshnessOptions(command, invocation);
  command.SetDetails(
      "If the file names pairs, answers each, as 'hullctl batch' does. Otherwise finds all pairs\n"
      "that collide or are within the clearance, as 'hullctl scene FILE' does. Uses the\n"
      "hulls and bodies on the server; 'hullctl scene apply' creates them.");
  command.SetExamples({{"", "hullctl scene check cell.yaml --separation"}});
  OnGiven(command, invocation, arguments, CheckScene);
}

}  // namespace

void AddSceneCommand(Command program, Invocation* invocation) {
  auto arguments = std::make_shared<SceneArguments>();
  Command command =
      program.AddCommand("scene", "Find all colliding pairs of a scene; manage scene files");
  command.AddText("FILE", &arguments->file, "The scene; - is standard input");
  AddWantedOptions(command, &arguments->details);
  AddChoiceOptions(command, arguments.get());
  AddFreshnessOptions(command, invocation);
  command.SetDetails(std::string(kSceneFileHelp) +
                     "\n"
                     "With a clearance, separated pairs within it are found, too.");
  command.SetExamples(
      {{"", "hullctl scene scene.yaml"},
       {"Pairs within a centimeter", "hullctl scene scene.yaml --clearance 0.01 --separation"},
       {"The five nearest pairs", "hullctl scene scene.yaml --nearest 5"},
       {"The first contact of a scene in motion", "hullctl scene scene.yaml --first"}});
  command.OnGiven([=] {
    // A subcommand has already set the action.
    if (invocation->action == nullptr) {
      invocation->action = [=] { return FindInScene(*invocation, *arguments); };
    } else if (!arguments->file.empty()) {
      invocation->action = [=] {
        return invocation->FailUsage(
            absl::StrCat("unexpected argument ", Quoted(arguments->file), "; a scene is one file"));
      };
    }
  });
  AddSceneSyncCommands(command, invocation);
  AddCheck(command, invocation);
}

}  // namespace hulld
