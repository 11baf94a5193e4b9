#include <absl/strings/str_cat.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <numbers>
#include <set>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/command_line/interrupt.h"
#include "client/hullctl/load/point_generator.h"
#include "client/hullctl/printing/progress_bar.h"
#include "client/hullctl/robot/check_scope.h"
#include "client/hullctl/robot/robot_model.h"
#include "client/hullctl/robot/waypoint_stream.h"

namespace hulld {
namespace {

constexpr uint64_t kDefaultSamples = 10000;

struct AcmArguments {
  RobotArguments robot;
  uint64_t samples = kDefaultSamples;
  uint64_t seed = 1;
  std::string file;
};

// Returns a number for each variable: uniform within the limits of its joint, or over a full turn
// without limits. Planar and floating joints stay at rest.
std::vector<double> RandomValues(const Robot& robot, Xoshiro256* random) {
  std::vector<double> values = RestValues(robot);
  const std::vector<JointVariable> variables = robot.Variables();
  for (size_t i = 0; i < values.size(); ++i) {
    const RobotJoint& joint = robot.joints[static_cast<size_t>(variables[i].joint)];
    if (joint.is_loose()) continue;
    const std::array<double, 2> range =
        joint.limits.value_or(std::array<double, 2>{-std::numbers::pi, std::numbers::pi});
    const double t = random->NextUnit();
    values[i] = (1 - t) * range[0] + t * range[1];
  }
  return values;
}

// Returns the pairs of links with a planar or floating joint between them. Their relative motion is
// unbounded, so samples are not evidence for them.
std::set<LinkPair> LoosePairs(const Robot& robot) {
  // The topmost ancestor of each link without such a joint in between.
  std::vector<int> top;
  for (const RobotLink& link : robot.links) {
    const int self = static_cast<int>(top.size());
    const RobotJoint* const joint =
        link.parent_joint < 0 ? nullptr : &robot.joints[static_cast<size_t>(link.parent_joint)];
    const bool hangs = joint != nullptr && !joint->is_loose();
    top.push_back(hangs ? top[static_cast<size_t>(joint->parent)] : self);
  }
  std::set<LinkPair> pairs;
  for (size_t a = 0; a < top.size(); ++a) {
    for (size_t b = a + 1; b < top.size(); ++b) {
      if (top[a] != top[b]) pairs.insert({static_cast<int>(a), static_cast<int>(b)});
    }
  }
  return pairs;
}

// Number of samples in which the shapes of two links collided.
struct Tally {
  uint64_t colliding = 0;
  // The last counted sample, so that a link with several shapes counts once.
  uint64_t last = ~uint64_t{0};
};

std::vector<DisabledPair> Judge(const std::set<LinkPair>& adjacent,
                                const std::map<LinkPair, Tally>& tallies, uint64_t samples) {
  std::vector<DisabledPair> pairs;
  pairs.reserve(adjacent.size() + tallies.size());
  for (const LinkPair& links : adjacent) pairs.push_back({links, "Adjacent"});
  for (const auto& [links, tally] : tallies) {
    if (tally.colliding == 0) pairs.push_back({links, "Never"});
    if (tally.colliding == samples) pairs.push_back({links, "Always"});
  }
  std::ranges::sort(pairs, {}, &DisabledPair::links);
  return pairs;
}

absl::Status Sample(const Invocation& run, const AcmArguments& arguments, const RobotModel& model,
                    const Client& client, const std::atomic<bool>& stopped,
                    std::map<LinkPair, Tally>* tallies, const std::vector<uint32_t>& pairs) {
  absl::Status problem;
  WaypointStream stream(
      client, MakeCheckScope(model, {}, pairs), {}, 0,
      [&](uint64_t sample, size_t pair, const AnswerRow& row, const std::string& cause) {
        const LinkPair links =
            MakeLinkPair(model.parts[pairs[2 * pair]].link, model.parts[pairs[2 * pair + 1]].link);
        if (row.relation == v1::RELATION_UNSPECIFIED) {
          problem = absl::InternalError(absl::StrCat("a pair cannot be checked: ", cause));
        }
        Tally& tally = (*tallies)[links];
        if (row.relation == v1::RELATION_SEPARATED || tally.last == sample) return;
        tally.last = sample;
        ++tally.colliding;
      });
  ProgressBar bar(run.err, run.shows_progress, "samples", arguments.samples);
  Xoshiro256 random(arguments.seed);
  for (uint64_t done = 0; done < arguments.samples && !stopped;) {
    const auto count =
        static_cast<size_t>(std::min<uint64_t>(stream.lanes(), arguments.samples - done));
    std::vector<double> poses;
    for (size_t i = 0; i < count; ++i) {
      model.AppendPoses(kNoMotion, AllJointValues(model.robot, RandomValues(model.robot, &random)),
                        &poses);
    }
    if (absl::Status status = stream.Query(count, poses); !status.ok()) return status;
    if (!problem.ok()) return problem;
    bar.Update(done += count);
  }
  bar.Clear();
  if (stopped) return absl::CancelledError("stopped; nothing was written");
  return stream.Close();
}

ExitCode MakeAcm(const Invocation& run, const AcmArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, auto model, ReadRobot(arguments.robot));
  std::atomic<bool> stopped = false;
  const Interrupt interrupt([&stopped] { stopped = true; });
  const Client client = run.MakeClient();
  absl::Status status = PrepareHulls(run, arguments.robot, client, &model);
  const std::set<LinkPair> adjacent = AdjacentPairs(model.robot);
  std::set<LinkPair> left_out = LoosePairs(model.robot);
  left_out.insert(adjacent.begin(), adjacent.end());
  const std::vector<uint32_t> pairs = model.PairsWithout(left_out);
  std::map<LinkPair, Tally> tallies;
  if (status.ok() && !pairs.empty()) {
    status = Sample(run, arguments, model, client, stopped, &tallies, pairs);
  }
  if (!status.ok()) {
    return absl::IsInvalidArgument(status) ? run.FailUsage(status) : run.Fail(status);
  }
  const std::vector<DisabledPair> disabled = Judge(adjacent, tallies, arguments.samples);
  const std::string comment = absl::StrCat(
      "Adjacent: connected by a joint, or through links without shapes. Never, Always: in ",
      arguments.samples, " random configurations (seed ", arguments.seed,
      "), which is evidence, not proof.");
  return run.WriteFile(arguments.file,
                       [&](std::ostream& out) { WriteSrdf(model.robot, disabled, comment, out); });
}

}  // namespace

void AddRobotAcmCommand(Command robot, Invocation* invocation) {
  auto arguments = std::make_shared<AcmArguments>();
  Command command = robot.AddCommand("acm", "Write the pairs that never or always collide as SRDF");
  AddRobotArguments(command, &arguments->robot);
  command.AddNumber("--samples", 1, uint64_t{1} << 32,
                    absl::StrCat("Number of configurations (default ", kDefaultSamples, ")"),
                    &arguments->samples);
  command.AddNumber("--seed", 0, kAnyNumber, "Seed of the configurations (default 1)",
                    &arguments->seed);
  command.AddText("-o,--out", &arguments->file, "File to write (default: standard output)")
      .ValueName("FILE");
  command.SetDetails(
      std::string(kRobotHelp) +
      "\n"
      "Joint values are uniform within the limits, or over a full turn without limits. The same\n"
      "options sample the same configurations. Links connected by a joint, or by joints through\n"
      "links without shapes, are written as Adjacent and not sampled. Links with a planar or\n"
      "floating joint between them are neither sampled nor written, as their motion is unbounded.\n"
      "Touching counts as colliding.");
  command.SetExamples({{"", "hullctl robot acm arm.urdf --samples 10000 -o arm.srdf"}});
  OnGiven(command, invocation, arguments, MakeAcm);
}

}  // namespace hulld
