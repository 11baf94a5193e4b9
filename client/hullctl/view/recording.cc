#include "client/hullctl/view/recording.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include <set>

#include "client/hullctl/printing/json.h"
#include "client/hullctl/view/answer_feed.h"
#include "client/hullctl/view/geometry_feed.h"
#include "client/hullctl/view/protocol.h"

namespace hulld {
namespace {

// Returns a frame for each file, hull, and body of the scene, and for each hull of a body.
std::string AllFrames(const Client& client, const ViewScene& scene) {
  std::string frames = "[";
  const auto add = [&](const ShapeRequest& shape, std::vector<std::string>* pieces) {
    const std::string frame = FrameFor(client, scene.files, shape, pieces);
    absl::StrAppend(&frames, frames.size() > 1 ? "," : "", QuoteJson(absl::Base64Escape(frame)));
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
  return frames + "]";
}

absl::StatusOr<std::string> AllPairs(const Client& client, const ViewScene& scene) {
  std::string answers = "[";
  const auto& objects = scene.objects;
  if (objects.size() > kMostRecordedObjects) return answers + "]";
  for (uint32_t a = 0; a < objects.size(); ++a) {
    for (uint32_t b = a + 1; b < objects.size(); ++b) {
      if (objects[a].hull_id.empty() || objects[b].hull_id.empty()) continue;
      auto response = client.CheckCollision(PairRequest(objects[a], objects[b], true));
      if (absl::IsResourceExhausted(response.status())) {
        // For bodies of so many pieces that no message can hold their certificate.
        response = client.CheckCollision(PairRequest(objects[a], objects[b], false));
      }
      if (!response.ok()) return response.status();
      absl::StrAppend(&answers, answers.size() > 1 ? "," : "",
                      PairAnswerJson({a, b}, objects[a], objects[b], 0, *response));
    }
  }
  return answers + "]";
}

}  // namespace

absl::StatusOr<std::string> RecordScene(const ViewProgram& program, const ViewScene& scene) {
  const auto collisions = SceneAnswerJson(program.client, scene.rules, scene.objects, 0, 0);
  if (!collisions.ok()) return collisions.status();
  const auto answers = AllPairs(program.client, scene);
  if (!answers.ok()) return answers.status();
  return JsonObject()
      .AddJson("hello", HelloMessage(program))
      .AddJson("scene", SceneMessage(scene, 1))
      .AddJson("frames", AllFrames(program.client, scene))
      .AddJson("collisions", *collisions)
      .AddJson("answers", *answers)
      .Close();
}

}  // namespace hulld
