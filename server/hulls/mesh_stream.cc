#include "server/hulls/mesh_stream.h"

#include <absl/status/status.h>

#include <algorithm>
#include <utility>

#include "core/hull/simplification/simplify.h"
#include "server/contract/status_map.h"
#include "server/settings/config.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

constexpr size_t kVerticesPerMessage = Config::kReplyMessageBytes / (3 * sizeof(double));
// An index takes at most 5 bytes.
constexpr int kIndicesPerMessage = Config::kReplyMessageBytes / 5;

}  // namespace

grpc::ServerWriteReactor<v1::GetHullMeshResponse>* MeshStream::Start(
    grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
    WorkerPool& readers, const v1::GetHullMeshRequest& request) {
  auto* stream = new MeshStream(context, admission);
  const absl::Status begun = stream->call_.Begin();
  if (begun.ok()) {
    // gRPC keeps the request until the call is done.
    readers.Submit([stream, &registry, &request] { stream->Open(registry, request); });
  } else {
    stream->Finish(stream->call_.End(begun));
  }
  return stream;
}

void MeshStream::Open(Registry& registry, const v1::GetHullMeshRequest& request) {
  absl::Status valid = CheckHullId(call_.caller(), request.hull_id(), "hull_id");
  if (!valid.ok()) return Finish(call_.End(valid));
  auto resolved = registry.Resolve(request.hull_id(), [this] { return call_.ShouldStop(); });
  if (call_.ShouldStop()) return Finish(call_.End(call_.StopStatus()));
  if (!resolved.ok()) return Finish(call_.End(resolved.status()));
  mesh_ =
      std::shared_ptr<const Hull>(resolved->second.served, &resolved->second.served->hull());
  v1::MeshHeader* header = message_.mutable_header();
  if (request.has_simplification()) {
    const absl::Status simplified = Simplify(request.simplification(), header);
    if (call_.ShouldStop()) return Finish(call_.End(call_.StopStatus()));
    if (!simplified.ok()) return Finish(call_.End(Prefixed("simplification: ", simplified)));
  }
  EncodeHeader(registry.store(), resolved->first, header->mutable_header());
  EncodeRecord(resolved->second.record, header->mutable_hull());
  header->set_facet_count(mesh_->facet_count());
  header->set_vertex_count(mesh_->vertices().size());
  StartWrite(&message_);
}

absl::Status MeshStream::Simplify(const v1::Simplification& simplification,
                                  v1::MeshHeader* header) {
  const SimplifyTarget target = {static_cast<size_t>(simplification.max_vertices()),
                                 simplification.max_error(), [this] { return call_.ShouldStop(); }};
  absl::StatusOr<SimplifiedHull> simplified;
  switch (simplification.side()) {
    case v1::SIMPLIFICATION_SIDE_INSIDE:
      simplified = SimplifyInside(*mesh_, target);
      break;
    case v1::SIMPLIFICATION_SIDE_OUTSIDE:
      simplified = SimplifyOutside(*mesh_, target);
      break;
    default:
      return absl::InvalidArgumentError("side must be INSIDE or OUTSIDE");
  }
  if (!simplified.ok()) return simplified.status();
  header->set_error(simplified->error);
  mesh_ = std::make_shared<const Hull>(std::move(simplified->hull));
  return absl::OkStatus();
}

void MeshStream::OnWriteDone(bool ok) {
  if (call_.ShouldStop()) return Finish(call_.End(call_.StopStatus()));
  if (!ok) return Finish(call_.End(absl::CancelledError("the client is gone")));
  if (!NextMessage()) return Finish(call_.End(absl::OkStatus()));
  StartWrite(&message_);
}

bool MeshStream::NextMessage() {
  message_.Clear();
  if (next_vertex_ < mesh_->vertices().size()) {
    FillVertices(message_.mutable_vertices());
    return true;
  }
  if (next_facet_ < mesh_->facet_count()) {
    FillFacets(message_.mutable_facets());
    return true;
  }
  return false;
}

void MeshStream::FillVertices(v1::MeshVertices* message) {
  const auto vertices = mesh_->vertices();
  const size_t end = std::min(vertices.size(), next_vertex_ + kVerticesPerMessage);
  message->mutable_xyz()->Reserve(static_cast<int>(3 * (end - next_vertex_)));
  for (; next_vertex_ < end; ++next_vertex_) {
    for (int i = 0; i < 3; ++i) message->add_xyz(vertices[next_vertex_][i]);
  }
}

// Whole facets only; one that is larger than a message makes a message of its own.
void MeshStream::FillFacets(v1::MeshFacets* message) {
  while (next_facet_ < mesh_->facet_count()) {
    const auto facet = mesh_->facet(next_facet_);
    const int after =
        message->sizes_size() + 1 + message->indices_size() + static_cast<int>(facet.size());
    if (message->sizes_size() > 0 && after > kIndicesPerMessage) return;
    message->add_sizes(static_cast<uint32_t>(facet.size()));
    for (const uint32_t index : facet) message->add_indices(index);
    ++next_facet_;
  }
}

}  // namespace hulld::server
