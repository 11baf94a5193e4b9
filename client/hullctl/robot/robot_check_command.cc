#include <absl/strings/str_cat.h>

#include <atomic>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"
#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/command_line/query_options.h"
#include "client/hullctl/printing/answer_text.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/robot/check_scope.h"
#include "client/hullctl/robot/continuous_check.h"
#include "client/hullctl/robot/robot_model.h"
#include "client/hullctl/robot/waypoint_source.h"
#include "client/hullctl/robot/waypoint_stream.h"
#include "client/hullctl/scene/scene_file.h"
#include "client/hullctl/scene/scene_sync.h"
#include "client/hullctl/view/view_scene.h"
#include "client/packed_placements.h"
#include "client/robot/joint_file.h"

namespace hulld {
namespace {

// Maximum number of limit violations printed individually; the rest are only counted.
constexpr size_t kMaxWarnings = 5;
// A micrometer.
constexpr double kDefaultResolution = 1e-6;

struct RobotCheckArguments {
  RobotArguments robot;
  std::string srdf;
  std::string joints;
  // NAME=VALUE each.
  std::vector<std::string> joint_values;
  RigidPose X_WB = kNoMotion;
  std::string scene;
  // NAME,NAME each.
  std::vector<std::string> ignored;
  bool adjacent = false;
  bool first = false;
  bool continuous = false;
  double resolution = kDefaultResolution;
  QueryDetails details;
};

// Returns true if a joint connects the two links.
bool AreJoined(const Robot& robot, const LinkPair& pair) {
  const auto hangs_on = [&robot](int child, int parent) {
    const int joint = robot.links[static_cast<size_t>(child)].parent_joint;
    return joint >= 0 && robot.joints[static_cast<size_t>(joint)].parent == parent;
  };
  return hangs_on(pair.first, pair.second) || hangs_on(pair.second, pair.first);
}

// One run: the robot, its sequence of waypoints, and the output about them.
class RobotCheck {
 public:
  RobotCheck(const Invocation& run, const RobotCheckArguments& arguments, RobotModel model)
      : run_(run),
        arguments_(arguments),
        model_(std::move(model)),
        client_(run.MakeClient()),
        bar_(run.err, run.shows_progress, "checks", 0),
        waypoints_(model_.robot, arguments.joint_values) {}

  ExitCode Run();

 private:
  // Reports an error of a file or a call.
  ExitCode Fail(const absl::Status& status) const {
    return absl::IsInvalidArgument(status) ? run_.FailUsage(status) : run_.Fail(status);
  }

  absl::Status AddScene();
  absl::Status ChoosePairs();
  absl::Status OpenWaypoints() { return waypoints_.Open(arguments_.joints); }
  void WarnOfLimits(uint64_t waypoint, const Waypoint& free_values);
  absl::Status CheckContinuousOptions();
  absl::StatusOr<std::vector<Waypoint>> ReadWaypoints(size_t limit);
  bool IsFinished() const { return stopped_ || !run_.out || (arguments_.first && HasContact()); }
  bool HasContact() const { return first_.has_value() || first_event_.has_value(); }
  absl::Status CheckWaypoints(CheckScope scope);
  absl::Status CheckMotions(CheckScope scope);
  void Take(uint64_t waypoint, size_t pair, const AnswerRow& row, const std::string& problem);
  void PrintFailure(uint64_t waypoint, size_t pair, const std::string& problem);
  void TakeOfMany(uint64_t waypoint, size_t pair, const AnswerRow& row, bool collides);
  void PrintRow(uint64_t waypoint, const char* event, size_t pair, const AnswerRow& row);
  std::string TextOf(size_t pair, const AnswerRow& row) const;
  void TakeEvent(const ContinuousCheck::Event& event);
  void PrintEvent(const ContinuousCheck::Event& event, const char* name);
  void PrintHead();
  void PrintTotals();
  void PrintMotionTotals();
  const std::string& NameOf(size_t pair, size_t side) const {
    return names_[pairs_[2 * pair + side]];
  }

  const Invocation& run_;
  const RobotCheckArguments& arguments_;
  RobotModel model_;
  const Client client_;
  ProgressBar bar_;
  // Surroundings of the robot, if any.
  Scene scene_;
  Surroundings around_;
  // Names of the parts, then of the surroundings.
  std::vector<std::string> names_;
  std::vector<uint32_t> pairs_;
  // Number of excluded pairs of links with shapes, and the reason.
  size_t left_out_ = 0;
  std::string left_out_by_;
  // Number of these that are adjacent through links without shapes.
  size_t left_out_bare_ = 0;

  WaypointSource waypoints_;
  std::atomic<bool> stopped_ = false;

  std::unordered_map<int, uint64_t> counts_;
  // Number of waypoints read and checked.
  uint64_t checked_ = 0;
  uint64_t failed_ = 0;
  uint64_t beyond_limits_ = 0;
  uint64_t in_contact_ = 0;
  std::optional<uint64_t> last_contact_;
  struct Contact {
    uint64_t waypoint;
    size_t pair;
    v1::Relation relation;
  };
  std::optional<Contact> first_;
  // With --continuous: the first contact, and the pairs in contact and undecided.
  std::optional<ContinuousCheck::Event> first_event_;
  std::set<size_t> contacts_;
  std::set<size_t> undecided_;
  // True for each pair that collided at the previous waypoint.
  std::vector<bool> collides_;
};

absl::Status RobotCheck::AddScene() {
  for (const RobotPart& part : model_.parts) names_.push_back(part.name);
  if (arguments_.scene.empty()) return absl::OkStatus();
  HULLD_ASSIGN_OR_RETURN(const auto source, ByteSource::Open(arguments_.scene));
  HULLD_ASSIGN_OR_RETURN(scene_, ReadScene(source.get()));
  HULLD_RETURN_IF_ERROR(PutSceneIfLocal(run_, arguments_.scene));
  for (uint32_t i = 0; i < scene_.size(); ++i) {
    names_.push_back(scene_.NameOf(i));
    around_.hulls.push_back(*scene_.HullOf(i));
    const v1::Placement placement = scene_.PlacementOf(i);
    around_.radii.push_back(placement.radius());
    const RigidPose pose = NumbersOf(placement.pose());
    around_.poses.insert(around_.poses.end(), pose.begin(), pose.end());
  }
  return absl::OkStatus();
}

absl::Status RobotCheck::ChoosePairs() {
  std::set<LinkPair> out;
  if (!arguments_.srdf.empty()) {
    HULLD_ASSIGN_OR_RETURN(out, ReadDisabledPairs(arguments_.srdf, model_.robot));
    left_out_by_ = arguments_.srdf;
  } else if (!arguments_.adjacent) {
    out = AdjacentPairs(model_.robot);
    left_out_by_ = "adjacency";
  }
  pairs_ = model_.PairsWithout(out);
  left_out_ = (model_.PairsWithout({}).size() - pairs_.size()) / 2;
  if (arguments_.srdf.empty()) {
    std::erase_if(out, [this](const LinkPair& pair) { return AreJoined(model_.robot, pair); });
    left_out_bare_ = (model_.PairsWithout({}).size() - model_.PairsWithout(out).size()) / 2;
  }
  const auto robot_parts = static_cast<uint32_t>(model_.parts.size());
  for (uint32_t a = 0; a < robot_parts; ++a) {
    for (uint32_t b = robot_parts; b < names_.size(); ++b) pairs_.insert(pairs_.end(), {a, b});
  }
  HULLD_RETURN_IF_ERROR(RemoveIgnored(arguments_.ignored, model_, names_, &pairs_));
  if (!pairs_.empty()) return absl::OkStatus();
  const std::string hint = !arguments_.ignored.empty() ? "--ignore excludes all of them"
                           : left_out_ == 0 ? "a pair needs two links with shapes, or --scene"
                           : arguments_.srdf.empty()
                               ? "--adjacent includes adjacent links"
                               : absl::StrCat(arguments_.srdf, " disables all of them");
  return absl::InvalidArgumentError(absl::StrCat("no pair of links is left to check; ", hint));
}

void RobotCheck::WarnOfLimits(uint64_t waypoint, const Waypoint& free_values) {
  const std::vector<std::string> problems =
      LimitProblems(model_.robot, AllJointValues(model_.robot, free_values));
  if (problems.empty()) return;
  if (beyond_limits_++ >= kMaxWarnings) return;
  bar_.Clear();
  const std::string line = waypoints_.LineOf(waypoint);
  for (const std::string& problem : problems) {
    run_.err << "hullctl: warning: " << line << (line.empty() ? "" : ": ") << problem << "\n";
  }
}

// Returns the next waypoints; empty at the end.
absl::StatusOr<std::vector<Waypoint>> RobotCheck::ReadWaypoints(size_t limit) {
  std::vector<Waypoint> waypoints;
  while (waypoints.size() < limit) {
    Waypoint values;
    HULLD_ASSIGN_OR_RETURN(const auto more, waypoints_.Next(&values));
    if (!more) break;
    WarnOfLimits(checked_ + waypoints.size(), values);
    waypoints.push_back(std::move(values));
  }
  return waypoints;
}

absl::Status RobotCheck::CheckWaypoints(CheckScope scope) {
  v1::CollisionStreamOpen query;
  arguments_.details.Apply(&query);
  // A single waypoint is examined in detail.
  if (!waypoints_.has_many() && query.tolerance() == 0) {
    query.mutable_wanted()->set_separation(true);
  }
  WaypointStream stream(client_, std::move(scope), query.wanted(), query.tolerance(),
                        [this](uint64_t waypoint, size_t pair, const AnswerRow& row,
                               const std::string& problem) { Take(waypoint, pair, row, problem); });
  while (!IsFinished()) {
    HULLD_ASSIGN_OR_RETURN(const auto waypoints, ReadWaypoints(stream.lanes()));
    if (waypoints.empty()) break;
    std::vector<double> poses;
    for (const Waypoint& values : waypoints) {
      model_.AppendPoses(arguments_.X_WB, AllJointValues(model_.robot, values), &poses);
    }
    HULLD_RETURN_IF_ERROR(stream.Query(waypoints.size(), poses));
    checked_ += waypoints.size();
    bar_.Update(checked_ * pairs_.size() / 2);
  }
  return stream.Close();
}

absl::Status RobotCheck::CheckContinuousOptions() {
  if (!arguments_.continuous) return absl::OkStatus();
  if (!waypoints_.has_many()) {
    return absl::InvalidArgumentError(
        "--continuous checks the motion between waypoints; pass at least two with --joints");
  }
  v1::Wanted wanted = arguments_.details.wanted;
  wanted.clear_clearance();
  if (wanted.ByteSizeLong() == 0 && !arguments_.details.tolerance.has_value()) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      "--continuous finds first contacts; it can be combined with --clearance, but not with "
      "--tolerance or options for other results");
}

absl::Status RobotCheck::CheckMotions(CheckScope scope) {
  ContinuousCheck check(client_, model_, std::move(scope),
                        {.X_WB = arguments_.X_WB,
                         .clearance = arguments_.details.wanted.clearance(),
                         .resolution = arguments_.resolution},
                        stopped_,
                        [this](const ContinuousCheck::Event& event) { TakeEvent(event); });
  while (!IsFinished()) {
    // The last waypoint of one call starts the motion of the next one.
    HULLD_ASSIGN_OR_RETURN(const auto waypoints, ReadWaypoints(check.waypoints_per_call()));
    if (waypoints.empty()) break;
    absl::Status checked = check.Check(waypoints);
    if (absl::IsCancelled(checked)) break;
    if (!checked.ok()) return checked;
    checked_ += waypoints.size();
    bar_.Update(checked_ * pairs_.size() / 2);
  }
  return absl::OkStatus();
}

void RobotCheck::TakeEvent(const ContinuousCheck::Event& event) {
  if (arguments_.first && HasContact() && event.waypoint > first_event_->waypoint) return;
  if (!event.problem.empty()) {
    PrintFailure(event.waypoint, event.pair, event.problem);
    return;
  }
  if (event.contact_time.has_value()) {
    contacts_.insert(event.pair);
    const bool is_first = !HasContact() || (event.waypoint == first_event_->waypoint &&
                                            *event.contact_time < *first_event_->contact_time);
    if (is_first) first_event_ = event;
    PrintEvent(event, arguments_.details.wanted.clearance() > 0 ? "NEAR" : "CONTACT");
    return;
  }
  undecided_.insert(event.pair);
  PrintEvent(event, "UNDECIDED");
}

void RobotCheck::PrintEvent(const ContinuousCheck::Event& event, const char* name) {
  bar_.Clear();
  v1::FirstContact contact;
  contact.set_separated_until(event.separated_until);
  if (event.contact_time.has_value()) contact.set_contact_time(*event.contact_time);
  if (run_.json()) {
    JsonObject object;
    object.Add("waypoint", event.waypoint + 1)
        .Add("a", NameOf(event.pair, 0))
        .Add("b", NameOf(event.pair, 1))
        .Add("event", name)
        .Add("relation", v1::Relation_Name(event.relation))
        .AddJson("firstContact", MessageJson(contact));
    run_.out << object.Close() << "\n";
    return;
  }
  run_.out << event.waypoint + 1 << "-" << event.waypoint + 2 << "\t" << name << "\t"
           << NameOf(event.pair, 0) << "\t" << NameOf(event.pair, 1);
  if (event.contact_time.has_value()) run_.out << "\t" << RelationText(event.relation);
  if (!run_.names()) {
    run_.out << "\tseparated until " << ShortestText(event.separated_until);
    if (event.contact_time.has_value()) {
      run_.out << "\tcontact at " << ShortestText(*event.contact_time);
    }
  }
  run_.out << "\n";
}

void RobotCheck::PrintMotionTotals() {
  if (run_.json() || run_.names()) return;
  const double clearance = arguments_.details.wanted.clearance();
  if (!arguments_.first || !HasContact()) {
    for (const size_t pair : contacts_) undecided_.erase(pair);
    const size_t others = contacts_.size() + undecided_.size() + failed_;
    run_.out << "# free " << pairs_.size() / 2 - others << (clearance > 0 ? " near " : " contact ")
             << contacts_.size() << " undecided " << undecided_.size() << " failed " << failed_
             << "\n# " << checked_ << " waypoints and the motion between them; free: ";
    if (clearance > 0) {
      run_.out << "separated by more than " << ShortestText(clearance) << ", proven\n";
    } else {
      run_.out << "separated, proven\n";
    }
  }
  if (!undecided_.empty()) {
    run_.out << "# not decided within " << ShortestText(arguments_.resolution)
             << "; a lower --resolution searches further\n";
  }
  if (first_event_.has_value()) {
    run_.out << "# first " << (clearance > 0 ? "approach" : "contact") << " after "
             << waypoints_.PlaceOf(first_event_->waypoint) << ", at "
             << ShortestText(*first_event_->contact_time)
             << " of the way to the next: " << NameOf(first_event_->pair, 0) << " with "
             << NameOf(first_event_->pair, 1) << ", " << RelationText(first_event_->relation)
             << "\n";
  } else if (undecided_.empty() && failed_ == 0) {
    run_.out << "# no contact\n";
  }
}

void RobotCheck::PrintRow(uint64_t waypoint, const char* event, size_t pair, const AnswerRow& row) {
  bar_.Clear();
  if (run_.json()) {
    JsonObject object;
    object.Add("waypoint", waypoint + 1).Add("a", NameOf(pair, 0)).Add("b", NameOf(pair, 1));
    if (*event != '\0') object.Add("event", event);
    AddRow(row, &object);
    run_.out << object.Close() << "\n";
    return;
  }
  if (*event != '\0') run_.out << waypoint + 1 << "\t" << event << "\t";
  run_.out << NameOf(pair, 0) << "\t" << NameOf(pair, 1) << "\t"
           << (run_.names() ? RelationText(row.relation) : TextOf(pair, row)) << "\n";
}

// Returns the answer's text; for surroundings that are a body, with its deciding piece.
std::string RobotCheck::TextOf(size_t pair, const AnswerRow& row) const {
  const auto robot_parts = static_cast<uint32_t>(model_.parts.size());
  const uint32_t b = pairs_[2 * pair + 1];
  AnswerRow shown = row;
  const int32_t piece = row.pieces.value_or(std::pair(-1, -1)).second;
  if (b < robot_parts || piece < 0) {
    shown.pieces.reset();
    return RowText(shown, run_.paint);
  }
  const uint32_t placement = b - robot_parts;
  return RowText(shown, run_.paint, scene_.NamesOfPieces(placement, placement, {-1, piece}));
}

void RobotCheck::Take(uint64_t waypoint, size_t pair, const AnswerRow& row,
                      const std::string& problem) {
  // With --first, ignores the rest of the message with the first contact.
  if (arguments_.first && first_.has_value() && waypoint > first_->waypoint) return;
  ++counts_[row.relation];
  const bool collides =
      row.relation == v1::RELATION_TOUCHING || row.relation == v1::RELATION_OVERLAPPING;
  if (collides && !first_.has_value()) first_ = Contact{waypoint, pair, row.relation};
  if (collides && last_contact_ != waypoint) {
    ++in_contact_;
    last_contact_ = waypoint;
  }
  if (row.relation == v1::RELATION_UNSPECIFIED) {
    PrintFailure(waypoint, pair, problem);
  } else if (waypoints_.has_many()) {
    TakeOfMany(waypoint, pair, row, collides);
  } else {
    PrintRow(waypoint, "", pair, row);
  }
}

void RobotCheck::PrintFailure(uint64_t waypoint, size_t pair, const std::string& problem) {
  bar_.Clear();
  if (failed_++ >= kMaxWarnings) return;
  run_.err << "hullctl: " << NameOf(pair, 0) << " with " << NameOf(pair, 1) << " at "
           << waypoints_.PlaceOf(waypoint) << ": " << problem << "\n";
}

void RobotCheck::TakeOfMany(uint64_t waypoint, size_t pair, const AnswerRow& row, bool collides) {
  if (collides == collides_[pair]) return;
  collides_[pair] = collides;
  PrintRow(waypoint, collides ? "ENTER" : "LEAVE", pair, row);
}

void RobotCheck::PrintHead() {
  if (run_.json() || run_.names()) return;
  for (const RobotPart& part : model_.parts) {
    if (part.hull.excess == 0) continue;
    run_.out << "# " << part.name << ": a cylinder within a polyhedron that reaches at most "
             << ShortestText(part.hull.excess) << " beyond it\n";
  }
  for (const std::string& note : model_.notes) run_.out << "# " << note << "\n";
  run_.out << "# " << Counted(pairs_.size() / 2, "pair");
  if (left_out_ > 0) run_.out << "; " << left_out_ << " excluded by " << left_out_by_;
  if (left_out_bare_ > 0) {
    run_.out << ", " << left_out_bare_ << " of them joined through links without shapes";
  }
  // Warnings follow.
  run_.out << "\n" << std::flush;
}

void RobotCheck::PrintTotals() {
  if (run_.json() || run_.names()) return;
  run_.out << "# separated " << counts_[v1::RELATION_SEPARATED] << " touching "
           << counts_[v1::RELATION_TOUCHING] << " overlapping "
           << counts_[v1::RELATION_OVERLAPPING];
  if (arguments_.details.tolerance.value_or(0) > 0) {
    run_.out << " within_tolerance " << counts_[v1::RELATION_WITHIN_TOLERANCE];
  }
  run_.out << " failed " << failed_ << "\n";
  if (!waypoints_.has_many()) return;
  if (!arguments_.first) {
    run_.out << "# " << in_contact_ << " of " << checked_ << " waypoints in contact\n";
  }
  if (first_.has_value()) {
    run_.out << "# first contact at " << waypoints_.PlaceOf(first_->waypoint) << ": "
             << NameOf(first_->pair, 0) << " with " << NameOf(first_->pair, 1) << ", "
             << RelationText(first_->relation) << "\n";
  } else {
    run_.out << "# no contact\n";
  }
}

ExitCode RobotCheck::Run() {
  for (const auto prepare : {&RobotCheck::AddScene, &RobotCheck::ChoosePairs,
                             &RobotCheck::OpenWaypoints, &RobotCheck::CheckContinuousOptions}) {
    if (absl::Status ready = (this->*prepare)(); !ready.ok()) return run_.FailUsage(ready);
  }
  const Interrupt interrupt([this] { stopped_ = true; });
  absl::Status status = PrepareHulls(run_, arguments_.robot, client_, &model_);
  if (!status.ok()) return Fail(status);
  collides_.assign(pairs_.size() / 2, false);
  PrintHead();
  CheckScope scope = MakeCheckScope(model_, around_, pairs_);
  status =
      arguments_.continuous ? CheckMotions(std::move(scope)) : CheckWaypoints(std::move(scope));
  bar_.Clear();
  if (!status.ok()) return Fail(status);
  arguments_.continuous ? PrintMotionTotals() : PrintTotals();
  if (beyond_limits_ > kMaxWarnings) {
    run_.err << "hullctl: warning: " << beyond_limits_ << " waypoints exceed limits of joints\n";
  }
  if (stopped_) run_.err << "hullctl: stopped after " << checked_ << " waypoints\n";
  if (failed_ == 0) return stopped_ ? ExitCode::kRequestFailed : ExitCode::kDone;
  run_.err << "hullctl: " << failed_ << " checks failed\n";
  return ExitCode::kSomeFailed;
}

ExitCode CheckRobot(const Invocation& run, const RobotCheckArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto model, ReadRobot(arguments.robot));
  return RobotCheck(run, arguments, std::move(model)).Run();
}

// Adds options that select the pairs of links.
void AddPairOptions(Command command, RobotCheckArguments* arguments) {
  command
      .AddText("--srdf", &arguments->srdf,
               "Exclude exactly the pairs of links that this semantic description disables")
      .ValueName("FILE");
  command.AddFlag("--adjacent", &arguments->adjacent,
                  "Without --srdf: include links connected by a joint, or by joints through links "
                  "without shapes");
}

// Adds options for one configuration of the robot or many.
void AddWaypointOptions(Command command, const std::shared_ptr<RobotCheckArguments>& arguments) {
  command
      .AddText("--joints,--trajectory", &arguments->joints,
               "CSV table: a header of joints, then a row per waypoint; - is standard input")
      .ValueName("FILE");
  command
      .AddRepeated("--joint", &arguments->joint_values,
                   "Value of a joint, without --joints; a pose [w,x,y,z,]x,y,z for a floating "
                   "joint, x,y,theta for a planar one; repeatable")
      .ValueName("NAME=VALUE");
  command
      .AddParsed(
          "--base",
          [](const std::string& text) -> absl::StatusOr<RigidPose> {
            HULLD_ASSIGN_OR_RETURN(const auto pose, ParsePose(text));
            return NumbersOf(pose);
          },
          &arguments->X_WB, "Pose of the robot: [w,x,y,z,]x,y,z (default: the origin)")
      .ValueName("POSE");
}

// Adds options for the surroundings of the robot.
void AddSceneOptions(Command command, RobotCheckArguments* arguments) {
  command
      .AddText(
          "--scene", &arguments->scene,
          "Scene around the robot, as for 'hullctl scene'; its hulls and bodies are on the server")
      .ValueName("FILE");
  command
      .AddRepeated("--ignore", &arguments->ignored,
                   "Exclude two links, or a link and a placement; repeatable")
      .ValueName("NAME,NAME");
}

void DescribeRobotCheck(Command command) {
  command.SetDetails(
      std::string(kRobotHelp) +
      "\n"
      "Pairs of shapes on the same link are never checked. Without --srdf, links connected by a\n"
      "joint, or by joints through links without shapes, are excluded, too, as in MoveIt, because\n"
      "they touch by design. Planar and floating joints do not count here. With --srdf, exactly\n"
      "the pairs that it disables are excluded.\n"
      "\n"
      "A joint without a value is at 0, or in the middle of its limits if these exclude 0. In\n"
      "--joints, a planar joint J has the columns J/x, J/y and J/theta, a floating one J/trans_x,\n"
      "J/trans_y, J/trans_z, J/rot_x, J/rot_y, J/rot_z and J/rot_w, as in MoveIt. A\n"
      "value beyond its limits causes a warning. For one configuration, every pair is printed\n"
      "with its separation. For several waypoints, a pair is printed when it starts (ENTER) and\n"
      "stops (LEAVE) colliding or touching, and the first contact at the end. Only the waypoints\n"
      "are checked, not the motion between them. A collision is an answer: exit code 0.\n"
      "\n"
      "With --continuous, every joint moves linearly from each waypoint to the next. A pair for\n"
      "which no line is printed is free throughout (by more than --clearance, if given); this is\n"
      "proven for the exact path. CONTACT, or NEAR with --clearance: the pair is free until\n"
      "the first time, and in contact, or within the clearance, at the second one. Both times are\n"
      "fractions of the way between the two waypoints; the pair is not checked after that.\n"
      "UNDECIDED: the pair comes within --resolution of contact between these waypoints, but no\n"
      "pose in contact was found.");
  command.SetExamples(
      {{"All joints at rest", "hullctl robot check arm.urdf --srdf arm.srdf"},
       {"One joint bent", "hullctl robot check arm.urdf --joint elbow_joint=2.5"},
       {"A trajectory within a cell",
        "hullctl robot check arm.urdf --joints path.csv --scene cell.yaml --ignore "
        "base_link,floor"},
       {"Until the first contact", "hullctl robot check arm.urdf --joints path.csv --first"},
       {"A trajectory, and the motion between its waypoints",
        "hullctl robot check arm.urdf --joints path.csv --continuous --clearance 0.01"}});
}

}  // namespace

void AddRobotCheckCommand(Command robot, Invocation* invocation) {
  auto arguments = std::make_shared<RobotCheckArguments>();
  Command command =
      robot.AddCommand("check", "Check a robot for collisions with itself and a scene");
  AddRobotArguments(command, &arguments->robot);
  AddPairOptions(command, arguments.get());
  AddWaypointOptions(command, arguments);
  AddSceneOptions(command, arguments.get());
  command.AddFlag("--first", &arguments->first, "Stop at the first waypoint in contact");
  const Option continuous =
      command.AddFlag("--continuous", &arguments->continuous,
                      "Check the motion between waypoints, too: joints move linearly");
  command
      .AddLength(
          "--resolution",
          "With --continuous: a pair that comes this close may be left undecided (default 1e-6)",
          &arguments->resolution)
      .Needs(continuous);
  AddWantedOptions(command, &arguments->details);
  DescribeRobotCheck(command);
  OnGiven(command, invocation, arguments, CheckRobot);
}

void AddRobotCommand(Command program, Invocation* invocation) {
  Command command = program.AddCommand("robot", "Check a robot (URDF) for collisions");
  AddRobotCheckCommand(command, invocation);
  AddRobotAcmCommand(command, invocation);
  command.SetExamples({{"", "hullctl robot check arm.urdf --srdf arm.srdf"},
                       {"", "hullctl robot acm arm.urdf --samples 10000 -o arm.srdf"}});
  command.RequireCommand();
}

}  // namespace hulld
