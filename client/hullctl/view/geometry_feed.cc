#include "client/hullctl/view/geometry_feed.h"

#include <utility>

namespace hulld {
namespace {

// Pages ask for each hull once, and again when it changed and they have the former one.
constexpr size_t kMostWishes = 1 << 20;

std::string MessageOf(const absl::Status& status) {
  return std::string(status.message().data(), status.message().size());
}

}  // namespace

std::string FrameFor(const Client& client, const ShapeFiles& files, const GeometryWish& wish) {
  if (wish.file) {
    if (*wish.file >= files.size()) return MissingFrame(wish, "there is no such file");
    return MeshFrame(*wish.file, *files[*wish.file]);
  }
  if (wish.simplified) {
    const auto mesh = client.GetHullMesh(*wish.simplified);
    return mesh.ok() ? SimplifiedFrame(*wish.simplified, *mesh)
                     : MissingFrame(wish, MessageOf(mesh.status()));
  }
  const std::string hull_id = wish.hull_id.value_or("");
  const auto mesh = client.GetHullMesh(hull_id);
  return mesh.ok() ? HullFrame(hull_id, *mesh) : MissingFrame(wish, MessageOf(mesh.status()));
}

GeometryFeed::GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page)
    : client_(client), page_(std::move(page)), thread_([this] { Run(); }) {}

GeometryFeed::~GeometryFeed() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void GeometryFeed::Show(const ShapeFiles& files) {
  const std::lock_guard lock(mutex_);
  files_ = files;
  wishes_.clear();
}

void GeometryFeed::Ask(const std::vector<GeometryWish>& wishes) {
  {
    const std::lock_guard lock(mutex_);
    if (wishes_.size() + wishes.size() > kMostWishes) return;
    wishes_.insert(wishes_.end(), wishes.begin(), wishes.end());
  }
  changed_.notify_all();
}

void GeometryFeed::Run() {
  while (true) {
    GeometryWish wish;
    ShapeFiles files;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return !wishes_.empty() || ended_; });
      if (ended_) return;
      wish = std::move(wishes_.front());
      wishes_.pop_front();
      files = files_;
    }
    if (!page_->SendBinary(FrameFor(client_, files, wish))) return;
  }
}

}  // namespace hulld
