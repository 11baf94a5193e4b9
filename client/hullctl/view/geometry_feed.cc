#include "client/hullctl/view/geometry_feed.h"

#include <utility>

namespace hulld {
namespace {

// Pages request each hull once, and again if it changed after they received it.
constexpr size_t kMostWishes = 1 << 20;

std::string MessageOf(const absl::Status& status) {
  return std::string(status.message().data(), status.message().size());
}

}  // namespace

std::string FrameFor(const Client& client, const ShapeFiles& files, const GeometryWish& wish,
                     std::vector<std::string>* pieces) {
  if (wish.file) {
    if (*wish.file >= files.size()) return MissingFrame(wish, "no such file");
    return MeshFrame(*wish.file, *files[*wish.file]);
  }
  if (wish.simplified) {
    const auto mesh = client.GetHullMesh(*wish.simplified);
    return mesh.ok() ? SimplifiedFrame(*wish.simplified, *mesh)
                     : MissingFrame(wish, MessageOf(mesh.status()));
  }
  const std::string hull_id = wish.hull_id.value_or("");
  const auto mesh = client.GetHullMesh(hull_id);
  if (mesh.ok()) return HullFrame(hull_id, *mesh);
  const auto body =
      absl::IsNotFound(mesh.status()) ? client.GetBody(hull_id) : absl::NotFoundError("");
  if (!body.ok()) {
    const bool is_neither = absl::IsNotFound(body.status());
    return MissingFrame(wish, MessageOf(is_neither ? mesh.status() : body.status()));
  }
  for (const v1::Placement& piece : body->pieces()) {
    if (pieces != nullptr) pieces->push_back(piece.hull_id());
  }
  return BodyFrame(*body);
}

GeometryFeed::GeometryFeed(const Client& client, std::shared_ptr<PageChannel> page)
    : files_(std::make_shared<ShapeFiles>()),
      page_(std::move(page)),
      worker_(kMostWishes, [&client, this](const Order& order) {
        return page_->SendBinary(FrameFor(client, *order.files, order.wish));
      }) {}

void GeometryFeed::Show(const ShapeFiles& files) {
  const std::lock_guard lock(mutex_);
  files_ = std::make_shared<ShapeFiles>(files);
  worker_.Forget();
}

void GeometryFeed::Ask(const std::vector<GeometryWish>& wishes) {
  const std::lock_guard lock(mutex_);
  for (const GeometryWish& wish : wishes) {
    if (worker_.Ask({wish, files_})) continue;
    page_->SendBinary(MissingFrame(wish, "too many shapes wait to be sent"));
  }
}

}  // namespace hulld
