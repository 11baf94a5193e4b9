#include "client/hullctl/view/page_session.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

std::string CommonPrefix(const std::string& a, const std::string& b) {
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return {a.begin(), end};
}

// Returns one watch that covers the scene. Events outside the scene are ignored.
v1::WatchHullsRequest WatchFor(const ViewScene& scene) {
  v1::WatchHullsRequest request;
  request.set_bodies(true);
  std::vector<std::string> names = scene.prefixes;
  names.insert(names.end(), scene.pieces.begin(), scene.pieces.end());
  for (const ViewObject& object : scene.objects) {
    if (!object.hull_id.empty() && object.hull == nullptr) names.push_back(object.hull_id);
  }
  if (names.empty()) return request;
  std::string prefix = names[0];
  for (const std::string& name : names) prefix = CommonPrefix(prefix, name);
  const bool is_one = scene.prefixes.empty() && scene.pieces.empty() &&
                      std::all_of(names.begin(), names.end(),
                                  [&names](const std::string& name) { return name == names[0]; });
  if (is_one) {
    request.set_hull_id(prefix);
  } else {
    request.set_prefix(prefix);
  }
  return request;
}

}  // namespace

std::string HelloMessage(const ViewProgram& program) {
  const auto scene_json = [](const ViewScene& scene) {
    return JsonObject().Add("key", scene.key).Add("title", scene.title).Close();
  };
  return TextMessage("hello", {{"server", QuoteJson(program.server)},
                               {"version", QuoteJson(HULLD_VERSION)},
                               {"up", QuoteJson(program.up)},
                               {"scenes", JsonArray(program.scenes, scene_json)}});
}

PageSession::PageSession(const ViewProgram& program, std::shared_ptr<PageChannel> page)
    : program_(program),
      page_(std::move(page)),
      answers_(program.client, page_),
      geometry_(program.client, page_) {
  page_->SendText(HelloMessage(program_));
  Show(program_.scenes.front().key);
}

PageSession::~PageSession() = default;

void PageSession::OnMessage(std::string_view json) {
  const auto message = ParsePageMessage(json);
  if (!message.ok()) {
    page_->SendText(ProblemMessage(absl::StrCat("The bridge cannot read a message from the page: ",
                                                message.status().message())));
    return;
  }
  if (message->show) Show(*message->show);
  if (!message->geometry.empty()) {
    WidenWatch(message->geometry);
    geometry_.Request(message->geometry);
  }
  if (message->query) answers_.Request(*message->query);
  if (message->joints) MoveJoints(*message->joints);
}

void PageSession::MoveJoints(const ViewConfiguration& configuration) {
  {
    const std::lock_guard lock(mutex_);
    if (configuration.scene != scene_) return;
  }
  if (configuration.values.size() != shown_->joints.joints.size() ||
      shown_->joints.joints.empty()) {
    page_->SendText(ProblemMessage("The page sent values of joints that are not in the scene."));
    return;
  }
  const auto poses = shown_->joints.poses(configuration.values);
  page_->SendText(poses.ok() ? TextMessage("poses", {{"scene", std::to_string(configuration.scene)},
                                                     {"poses", PosesJson(*poses)}})
                             : ProblemMessage(std::string(poses.status().message())));
}

void PageSession::Show(const std::string& key) {
  const auto scene = std::ranges::find(program_.scenes, key, &ViewScene::key);
  if (scene == program_.scenes.end()) {
    page_->SendText(ProblemMessage(absl::StrCat("There is no scene \"", key, "\".")));
    return;
  }
  if (!followers_.empty()) followers_.back()->Cancel();
  uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = ++scene_;
    prefixes_ = scene->prefixes;
    known_.clear();
    for (const ViewObject& object : scene->objects) known_.insert(object.hull_id);
    known_.insert(scene->pieces.begin(), scene->pieces.end());
  }
  shown_ = &*scene;
  answers_.Show(*scene, number);
  geometry_.Show(scene->files);
  page_->SendText(SceneMessage(*scene, number));
  if (program_.on_show) program_.on_show(key);
  if (!scene->prefixes.empty() || !scene->objects.empty()) Follow(WatchFor(*scene));
}

void PageSession::Follow(v1::WatchHullsRequest request) {
  std::erase_if(followers_, [](const auto& follower) { return follower->finished(); });
  if (!followers_.empty()) followers_.back()->Cancel();
  watched_ = std::move(request);
  uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = scene_;
  }
  followers_.push_back(std::make_unique<HullFollower>(
      program_.client, watched_,
      [this, number](const v1::HullEvent& event, bool synced) { TakeHull(number, event, synced); },
      [this](const std::string& error) { page_->SendText(ProblemMessage(error)); }));
}

void PageSession::WidenWatch(const std::vector<ShapeRequest>& shapes) {
  std::string prefix = watched_.hull_id().empty() ? watched_.prefix() : watched_.hull_id();
  bool is_covered = true;
  {
    const std::lock_guard lock(mutex_);
    for (const ShapeRequest& shape : shapes) {
      if (!shape.hull_id || !known_.insert(*shape.hull_id).second) continue;
      is_covered = is_covered && watched_.hull_id().empty() && shape.hull_id->starts_with(prefix);
      prefix = CommonPrefix(prefix, *shape.hull_id);
    }
  }
  if (is_covered) return;
  v1::WatchHullsRequest wider;
  wider.set_bodies(true);
  wider.set_prefix(prefix);
  Follow(std::move(wider));
}

void PageSession::TakeHull(uint64_t scene, const v1::HullEvent& event, bool synced) {
  const std::string& hull_id = event.hull().hull_id();
  bool is_new = false;
  {
    const std::lock_guard lock(mutex_);
    if (scene != scene_) return;
    const auto starts_so = [&hull_id](const std::string& prefix) {
      return hull_id.starts_with(prefix);
    };
    if (!known_.contains(hull_id)) {
      const bool is_deleted = event.kind() == v1::HULL_EVENT_KIND_DELETED;
      if (is_deleted || !std::any_of(prefixes_.begin(), prefixes_.end(), starts_so)) return;
      known_.insert(hull_id);
      is_new = true;
    }
  }
  if (is_new) {
    const std::vector<ViewObject> objects = {{hull_id, hull_id, -1, kNoMotion}};
    answers_.AddObjects(objects, scene);
    page_->SendText(TextMessage(
        "objects", {{"scene", std::to_string(scene)}, {"objects", ObjectsJson(objects)}}));
  }
  page_->SendText(TextMessage("hull", {{"event", MessageJson(event)}}));
  // The page already knows the initial state.
  if (synced || is_new) answers_.HullsChanged();
}

}  // namespace hulld
