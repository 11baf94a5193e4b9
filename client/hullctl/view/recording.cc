#include "client/hullctl/view/recording.h"

#include <absl/strings/escaping.h>

#include <algorithm>
#include <set>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/view/answer_feed.h"
#include "client/hullctl/view/geometry_feed.h"
#include "client/hullctl/view/protocol.h"

namespace hulld {
namespace {

// Returns a frame for each file, hull, and body of the scene, and for each hull of a body.
std::string AllFrames(const Client& client, const ViewScene& scene) {
  std::vector<std::string> frames;
  const auto add = [&](const ShapeRequest& shape, std::vector<std::string>* pieces) {
    const std::string frame = FrameFor(client, scene.files, shape, pieces);
    frames.push_back(QuoteJson(absl::Base64Escape(frame)));
  };
  for (uint32_t file = 0; file < scene.files.size(); ++file) {
    ShapeRequest shape;
    shape.file = file;
    add(shape, nullptr);
  }
  std::set<std::string> known;
  std::vector<std::string> wanted;
  for (const ViewObject& object : scene.objects) wanted.push_back(object.hull_id);
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i].empty() || !known.insert(wanted[i]).second) continue;
    ShapeRequest shape;
    shape.hull_id = wanted[i];
    add(shape, &wanted);
  }
  return JsonArray(frames);
}

// Returns the answer with its certificate; without it for bodies of so many pieces that no message
// can hold their certificate.
template <typename RequestWith>
absl::StatusOr<v1::CheckCollisionResponse> Proven(const Client& client,
                                                  const RequestWith& request_with) {
  auto response = client.CheckCollision(request_with(true));
  if (!absl::IsResourceExhausted(response.status())) return response;
  return client.CheckCollision(request_with(false));
}

absl::StatusOr<std::string> AllPairs(const Client& client, const std::vector<ViewObject>& objects) {
  std::vector<std::string> answers;
  for (uint32_t a = 0; a < objects.size(); ++a) {
    for (uint32_t b = a + 1; b < objects.size(); ++b) {
      if (objects[a].hull_id.empty() || objects[b].hull_id.empty()) continue;
      const auto request_with = [&](bool certificate) {
        return PairRequest(objects[a], objects[b], certificate);
      };
      HULLD_ASSIGN_OR_RETURN(const auto response, Proven(client, request_with));
      answers.push_back(PairAnswerJson({{a, b}, objects[a], objects[b]}, response));
    }
  }
  return JsonArray(answers);
}

// Returns the messages `motion` of all pairs that move, and adds the ends of their brackets to
// `times`.
std::string AllMotions(const Client& client, const std::vector<ViewObject>& objects,
                       std::set<double>* times) {
  std::vector<std::string> motions;
  for (uint32_t a = 0; a < objects.size(); ++a) {
    for (uint32_t b = a + 1; b < objects.size(); ++b) {
      if (!MotionRequest(objects[a], objects[b], false)) continue;
      const auto response = Proven(client, [&](bool certificate) {
        return *MotionRequest(objects[a], objects[b], certificate);
      });
      motions.push_back(MotionAnswerJson({{a, b}, objects[a], objects[b]}, response));
      if (!response.ok() || !response->first_contact().has_contact_time()) continue;
      times->insert(response->first_contact().separated_until());
      times->insert(response->first_contact().contact_time());
    }
  }
  return JsonArray(motions);
}

// Returns the poses of the jointed objects, and the answers about all of them.
absl::StatusOr<std::string> State(const Client& client, const ViewScene& scene,
                                  const std::vector<ViewObject>& objects, double time,
                                  bool with_answers) {
  HULLD_ASSIGN_OR_RETURN(const auto collisions,
                         SceneAnswerJson(client, scene.rules, scene.pairs, objects, 0, 0));
  HULLD_ASSIGN_OR_RETURN(const auto answers,
                         AllPairs(client, with_answers ? objects : std::vector<ViewObject>()));
  std::vector<RigidPose> poses;
  for (const ViewObject& object : objects) {
    if (object.is_jointed) poses.push_back(object.pose);
  }
  return JsonObject()
      .AddJson("time", ShortestText(time))
      .AddJson("poses", PosesJson(poses))
      .AddJson("collisions", collisions)
      .AddJson("answers", answers)
      .Close();
}

size_t PairCount(const ViewScene& scene) {
  const size_t count = scene.objects.size();
  return count * (count - 1) / 2;
}

// Returns the state at the start, at each waypoint, or at each of the `times` of a scene with
// motions.
absl::StatusOr<std::string> AllStates(const Client& client, const ViewScene& scene,
                                      const std::vector<double>& times) {
  std::vector<ViewObject> objects = scene.objects;
  const size_t count = std::max(times.size(), scene.joints.waypoints.size());
  const bool with_answers = count * PairCount(scene) <= kMaxRecordedAnswers;
  std::vector<std::string> states;
  for (size_t i = 0; i < count; ++i) {
    const double time = i < times.size() ? times[i] : 0;
    for (ViewObject& object : objects) {
      if (object.motion) object.pose = PoseAt(*object.motion, time);
    }
    if (!scene.joints.waypoints.empty()) {
      HULLD_ASSIGN_OR_RETURN(const auto poses, scene.joints.poses(scene.joints.waypoints[i]));
      auto pose = poses.begin();
      for (ViewObject& object : objects) {
        if (object.is_jointed) object.pose = *pose++;
      }
    }
    HULLD_ASSIGN_OR_RETURN(const auto state, State(client, scene, objects, time, with_answers));
    states.push_back(state);
  }
  return JsonArray(states);
}

}  // namespace

absl::StatusOr<std::string> RecordScene(const ViewProgram& program, const ViewScene& scene) {
  std::set<double> times = {0};
  const auto moves = [](const ViewObject& object) { return object.motion.has_value(); };
  if (std::ranges::any_of(scene.objects, moves)) {
    for (int step = 1; step <= kRecordedSteps; ++step) times.insert(1.0 * step / kRecordedSteps);
  }
  const bool is_small = PairCount(scene) <= kMaxRecordedAnswers;
  const std::string motions = is_small ? AllMotions(program.client, scene.objects, &times) : "[]";
  HULLD_ASSIGN_OR_RETURN(const auto states,
                         AllStates(program.client, scene, {times.begin(), times.end()}));
  return JsonObject()
      .AddJson("hello", HelloMessage(program))
      .AddJson("scene", SceneMessage(scene, 1))
      .AddJson("frames", AllFrames(program.client, scene))
      .AddJson("motions", motions)
      .AddJson("states", states)
      .Close();
}

}  // namespace hulld
