#include "client/hullctl/view/geometry_feed.h"

#include <utility>

namespace hulld {
namespace {

// Pages request each hull once, and again if it changed after they received it.
constexpr size_t kMaxShapes = 1 << 20;

std::string MessageOf(const absl::Status& status) {
  return std::string(status.message().data(), status.message().size());
}

}  // namespace

std::string FrameFor(const Client& client, const ShapeFiles& files, const ShapeRequest& shape,
                     std::vector<std::string>* pieces) {
  if (shape.file) {
    if (*shape.file >= files.size()) return MissingFrame(shape, "no such file");
    return MeshFrame(*shape.file, *files[*shape.file]);
  }
  if (shape.simplified) {
    const auto mesh = client.GetHullMesh(*shape.simplified);
    return mesh.ok() ? SimplifiedFrame(*shape.simplified, *mesh)
                     : MissingFrame(shape, MessageOf(mesh.status()));
  }
  const std::string hull_id = shape.hull_id.value_or("");
  for (const auto& file : files) {
    if (file->hull != nullptr && file->hull_name == hull_id) return HullFrame(hull_id, *file->hull);
  }
  const auto mesh = client.GetHullMesh(hull_id);
  if (mesh.ok()) return HullFrame(hull_id, *mesh);
  const auto body =
      absl::IsNotFound(mesh.status()) ? client.GetBody(hull_id) : absl::NotFoundError("");
  if (!body.ok()) {
    const bool is_neither = absl::IsNotFound(body.status());
    return MissingFrame(shape, MessageOf(is_neither ? mesh.status() : body.status()));
  }
  for (const v1::Placement& piece : body->pieces()) {
    if (pieces != nullptr) pieces->push_back(piece.hull_id());
  }
  return BodyFrame(*body);
}

GeometryFeed::GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page)
    : client_(client),
      page_(std::move(page)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void GeometryFeed::Show(const ShapeFiles& files) {
  const std::lock_guard lock(mutex_);
  files_ = std::make_shared<ShapeFiles>(files);
  waiting_.clear();
}

void GeometryFeed::Request(const std::vector<ShapeRequest>& shapes) {
  std::vector<ShapeRequest> refused;
  {
    const std::lock_guard lock(mutex_);
    for (const ShapeRequest& shape : shapes) {
      if (waiting_.size() < kMaxShapes) {
        waiting_.push_back(shape);
      } else {
        refused.push_back(shape);
      }
    }
  }
  changed_.notify_all();
  for (const ShapeRequest& shape : refused) {
    page_->SendBinary(MissingFrame(shape, "too many shapes are waiting to be sent"));
  }
}

void GeometryFeed::Run(const std::stop_token& stop) {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [this] { return !waiting_.empty(); });
    if (stop.stop_requested()) return;
    const ShapeRequest shape = std::move(waiting_.front());
    waiting_.pop_front();
    const std::shared_ptr<const ShapeFiles> files = files_;
    lock.unlock();
    if (!page_->SendBinary(FrameFor(client_, *files, shape))) return;
  }
}

}  // namespace hulld
