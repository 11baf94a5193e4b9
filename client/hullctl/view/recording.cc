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

std::vector<GeometryWish> AllShapes(const ViewScene& scene) {
  std::vector<GeometryWish> wishes;
  for (uint32_t file = 0; file < scene.files.size(); ++file) wishes.emplace_back().file = file;
  std::set<std::string> hull_ids;
  for (const ViewObject& object : scene.objects) {
    if (!object.hull_id.empty()) hull_ids.insert(object.hull_id);
  }
  for (const std::string& hull_id : hull_ids) wishes.emplace_back().hull_id = hull_id;
  return wishes;
}

absl::StatusOr<std::string> AllPairs(const Client& client, const ViewScene& scene) {
  std::string answers = "[";
  const auto& objects = scene.objects;
  if (objects.size() > kMostRecordedObjects) return answers + "]";
  for (uint32_t a = 0; a < objects.size(); ++a) {
    for (uint32_t b = a + 1; b < objects.size(); ++b) {
      if (objects[a].hull_id.empty() || objects[b].hull_id.empty()) continue;
      const auto response = client.CheckCollision(PairRequest(objects[a], objects[b]));
      if (!response.ok()) return response.status();
      absl::StrAppend(&answers, answers.size() > 1 ? "," : "",
                      PairAnswerJson({a, b}, objects[a], objects[b], 0, *response));
    }
  }
  return answers + "]";
}

}  // namespace

absl::StatusOr<std::string> RecordScene(const ViewProgram& program, const ViewScene& scene) {
  std::string frames = "[";
  for (const GeometryWish& wish : AllShapes(scene)) {
    absl::StrAppend(&frames, frames.size() > 1 ? "," : "",
                    QuoteJson(absl::Base64Escape(FrameFor(program.client, scene.files, wish))));
  }
  const auto collisions = SceneAnswerJson(program.client, scene.rules, scene.objects, 0, 0);
  if (!collisions.ok()) return collisions.status();
  const auto answers = AllPairs(program.client, scene);
  if (!answers.ok()) return answers.status();
  return JsonObject()
      .AddJson("hello", HelloMessage(program))
      .AddJson("scene", SceneMessage(scene, 1))
      .AddJson("frames", frames + "]")
      .AddJson("collisions", *collisions)
      .AddJson("answers", *answers)
      .Close();
}

}  // namespace hulld
