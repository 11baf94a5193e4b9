#include "client/hullctl/view/demo_scenes.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <utility>

#include "client/hullctl/load/point_generator.h"

namespace hulld {
namespace {

constexpr char kModels[] = "/usr/share/assimp/models/OBJ/";
// Pace of the growing hull: points per step, and time between steps.
constexpr uint64_t kGrowthPoints = 40;
constexpr std::chrono::milliseconds kGrowthPause{120};
constexpr int kGrowthSteps = 200;
constexpr double kGrownRadius = 6;

RigidPose MovedBy(double x, double y, double z) { return {1, 0, 0, 0, x, y, z}; }

// Returns points in balls of increasing radius, so that the hull grows on all sides.
v1::PointBlock GrowthOf(int step) {
  CloudOptions cloud;
  cloud.count = kGrowthPoints;
  cloud.seed = static_cast<uint64_t>(step);
  cloud.radius = kGrownRadius * step / kGrowthSteps;
  return CloudPoints(cloud);
}

absl::Status SendGrowth(const Client::PointSink& sink) { return sink(GrowthOf(1)); }

// Returns the pose that rotates a copy of a hull by half a turn about the vertical line through its
// vertex of largest x, moved by the fraction `shift` of the distance toward the mean of its
// vertices. With shift 0, both share exactly that vertex, and the plane of constant x through it
// separates the rest. Neither doubling a coordinate nor half a turn is rounded, so the contact is
// exact.
RigidPose TurnedAbout(const HullMesh& hull, double shift) {
  double sum_x = 0;
  double sum_y = 0;
  size_t extreme = 0;
  for (size_t i = 0; i < hull.xyz.size(); i += 3) {
    sum_x += hull.xyz[i];
    sum_y += hull.xyz[i + 1];
    if (hull.xyz[i] > hull.xyz[extreme]) extreme = i;
  }
  const auto count = static_cast<double>(hull.vertex_count());
  const double x = hull.xyz[extreme];
  const double y = hull.xyz[extreme + 1];
  return {0, 0, 0, 1, 2 * (x + shift * (sum_x / count - x)), 2 * (y + shift * (sum_y / count - y)),
          0};
}

// Creates the hulls and shapes of the scenes; keeps the first error.
class Workshop {
 public:
  Workshop(const Client& client, TemporaryHulls* hulls) : client_(client), hulls_(hulls) {}

  std::string Model(const std::string& file) {
    const std::string path = kModels + file;
    if (!IsFile(path)) {
      Note(absl::NotFoundError(absl::StrCat(path, " is missing; install assimp-testmodels")));
      return "";
    }
    return Take(hulls_->AddFile(path));
  }
  std::shared_ptr<const FileShape> Shape(const std::string& file) {
    auto shape = ReadShape(kModels + file);
    if (!shape.ok()) Note(shape.status());
    return std::make_shared<FileShape>(shape.ok() ? *std::move(shape) : FileShape());
  }
  std::string Hull(const std::string& name, const CloudOptions& cloud) {
    return Take(hulls_->Add(
        name, [&cloud](const Client::PointSink& sink) { return sink(CloudPoints(cloud)); }));
  }
  std::string Sprout(const std::string& name) { return Take(hulls_->Add(name, SendGrowth)); }
  RigidPose TurnedCopy(const std::string& hull_id, double shift) {
    const auto mesh = client_.GetHullMesh(hull_id);
    if (!mesh.ok()) Note(mesh.status());
    return mesh.ok() ? TurnedAbout(*mesh, shift) : kNoMotion;
  }

  const absl::Status& status() const { return status_; }

 private:
  void Note(const absl::Status& status) {
    if (status_.ok()) status_ = status;
  }
  std::string Take(absl::StatusOr<std::string> id) {
    if (!id.ok()) Note(id.status());
    return id.ok() ? *std::move(id) : "";
  }

  const Client& client_;
  TemporaryHulls* const hulls_;
  absl::Status status_;
};

// Returns a scene of two copies of a model, with its mesh.
ViewScene TwoCopies(const std::string& title, const std::string& note, const std::string& name,
                    const std::string& hull_id, std::shared_ptr<const FileShape> shape,
                    const RigidPose& pose_b) {
  ViewScene scene;
  scene.title = title;
  scene.note = note;
  scene.files = {std::move(shape)};
  scene.objects = {{name + " A", hull_id, 0, kNoMotion}, {name + " B", hull_id, 0, pose_b}};
  return scene;
}

ViewScene CubeScene(const std::string& cube) {
  ViewScene scene;
  scene.title = "Cubes that share a face, an edge, a corner";
  scene.note =
      "Touching is exact: move one by the smallest possible step, and they separate or overlap.";
  scene.objects = {{"cube", cube, -1, kNoMotion},
                   {"shares a face", cube, -1, MovedBy(2, 0, 0)},
                   {"shares an edge", cube, -1, MovedBy(-2, 2, 0)},
                   {"shares a corner", cube, -1, MovedBy(-2, -2, -2)}};
  return scene;
}

ViewScene BallScene(const std::string& large, const std::string& small) {
  ViewScene scene;
  scene.title = "Two balls of random points";
  scene.note = "Hulls of 3000 and of 100 points in balls of radius 1, their centers 1.9 apart.";
  scene.objects = {{"3000 points", large, -1, kNoMotion},
                   {"100 points", small, -1, MovedBy(1.9, 0, 0)}};
  return scene;
}

ViewScene GrowingScene(const std::string& live, const std::string& ball) {
  ViewScene scene;
  scene.title = "A live hull grows until it reaches a ball";
  scene.note = "Points stream into the hull while you watch. Show the scene again to start over.";
  scene.objects = {{"live", live, -1, kNoMotion}, {"ball", ball, -1, MovedBy(6, 0, 0)}};
  return scene;
}

}  // namespace

absl::StatusOr<std::vector<ViewScene>> MakeDemoScenes(const Client& client, TemporaryHulls* hulls) {
  // The scenes share their hulls.
  Workshop make(client, hulls);
  const std::string spider = make.Model("spider.obj");
  const std::string wuson = make.Model("WusonOBJ.obj");
  if (!make.status().ok()) return make.status();
  const auto spider_shape = make.Shape("spider.obj");
  const auto wuson_shape = make.Shape("WusonOBJ.obj");
  const std::string cube = make.Hull("cube", {Shape::kLattice, 27, 1, 1, 1, {-1, -1, -1}});
  const std::string ball_3000 = make.Hull("ball3000", {Shape::kBall, 3000, 1, 1, 1, {}});
  const std::string ball_100 = make.Hull("ball100", {Shape::kBall, 100, 2, 1, 1, {}});
  const std::string live = make.Sprout("live");
  const RigidPose spider_touches = make.TurnedCopy(spider, 0);
  const RigidPose wuson_touches = make.TurnedCopy(wuson, 0);
  const RigidPose wuson_overlaps = make.TurnedCopy(wuson, 1e-12);
  if (!make.status().ok()) return make.status();

  std::vector<ViewScene> scenes = {
      TwoCopies("Two Spiders, far apart", "Drag one: the answer follows.", "Spider", spider,
                spider_shape, MovedBy(200, 0, 0)),
      TwoCopies("Two Spiders that overlap", "Their meshes barely touch, but their hulls overlap.",
                "Spider", spider, spider_shape, MovedBy(100, 5, 0)),
      TwoCopies("Two Spiders that share one vertex", "They touch in exactly one point.", "Spider",
                spider, spider_shape, spider_touches),
      TwoCopies("Two Wusons that share one vertex", "They touch in exactly one point.", "Wuson",
                wuson, wuson_shape, wuson_touches),
      TwoCopies("Two Wusons that overlap by one part in 10\u00b9\u00b2",
                "No picture shows it; the certificate proves it.", "Wuson", wuson, wuson_shape,
                wuson_overlaps),
      CubeScene(cube),
      BallScene(ball_3000, ball_100),
      GrowingScene(live, ball_100),
  };
  for (size_t i = 0; i < scenes.size(); ++i) scenes[i].key = std::to_string(i);
  return scenes;
}

GrowingHull::GrowingHull(const Client& client, std::string hull_id)
    : client_(client),
      hull_id_(std::move(hull_id)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void GrowingHull::Restart() {
  {
    const std::lock_guard lock(mutex_);
    ++starts_;
  }
  changed_.notify_all();
}

void GrowingHull::Run(const std::stop_token& stop) {
  uint64_t started = 0;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [&] { return starts_ != started; });
      if (stop.stop_requested()) return;
      started = starts_;
    }
    Grow(started, stop);
  }
}

// An error, such as a lost server, ends the growth; the viewer shows the state reached.
void GrowingHull::Grow(uint64_t start, const std::stop_token& stop) {
  v1::ReplaceOpen open;
  open.set_hull_id(hull_id_);
  if (!client_.ReplaceHull(open, SendGrowth).ok()) return;
  AppendOptions options;
  // Commits each step before the next, so that a page sees it.
  options.max_in_flight_chunks = 1;
  const auto appender = client_.OpenAppend(hull_id_, options);
  if (!appender.ok()) return;
  for (int step = 2; step <= kGrowthSteps; ++step) {
    if (!(*appender)->Append(GrowthOf(step)).ok()) return;
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, kGrowthPause, [&] { return starts_ != start; });
    if (starts_ != start || stop.stop_requested()) return;
  }
  static_cast<void>((*appender)->Finish());
}

}  // namespace hulld
