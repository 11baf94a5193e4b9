#include "server/mesh_stream.h"

#include <absl/status/status.h>

#include <algorithm>
#include <utility>

#include "server/config.h"
#include "server/encode.h"
#include "server/hull_id.h"
#include "server/status_map.h"

namespace hulld::server {
namespace {

constexpr size_t kVerticesPerMessage = Config::kReplyMessageBytes / (3 * sizeof(double));
// An index takes at most 5 bytes.
constexpr int kIndicesPerMessage = Config::kReplyMessageBytes / 5;

}  // namespace

grpc::ServerWriteReactor<v1::GetHullMeshResponse>* MeshStream::Start(
    const grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
    WorkerPool& readers, const std::string& hull_id) {
  auto* stream = new MeshStream(context);
  absl::StatusOr<Admission::Ticket> ticket = admission.Admit();
  if (ticket.ok()) {
    stream->ticket_ = *std::move(ticket);
    readers.Submit([stream, &registry, hull_id] { stream->Open(registry, hull_id); });
  } else {
    stream->Finish(ToGrpc(ticket.status()));
  }
  return stream;
}

void MeshStream::Open(Registry& registry, const std::string& hull_id) {
  if (absl::Status s = ValidateHullId(hull_id, "hull_id"); !s.ok()) return Finish(ToGrpc(s));
  auto resolved = registry.Resolve(hull_id, [this] { return lifetime_.ShouldStop(); });
  if (lifetime_.ShouldStop()) return Finish(ToGrpc(lifetime_.StopStatus()));
  if (!resolved.ok()) return Finish(ToGrpc(resolved.status()));
  view_ = std::move(resolved->second);
  v1::MeshHeader* header = message_.mutable_header();
  EncodeHeader(registry.store(), resolved->first, header->mutable_header());
  EncodeRecord(view_.record, header->mutable_hull());
  header->set_facet_count(view_.hull->facet_count());
  StartWrite(&message_);
}

void MeshStream::OnWriteDone(bool ok) {
  if (lifetime_.ShouldStop()) return Finish(ToGrpc(lifetime_.StopStatus()));
  if (!ok) return Finish(grpc::Status(grpc::StatusCode::CANCELLED, "the client is gone"));
  if (!NextMessage()) return Finish(grpc::Status::OK);
  StartWrite(&message_);
}

bool MeshStream::NextMessage() {
  message_.Clear();
  if (next_vertex_ < view_.hull->vertices().size()) {
    FillVertices(message_.mutable_vertices());
    return true;
  }
  if (next_facet_ < view_.hull->facet_count()) {
    FillFacets(message_.mutable_facets());
    return true;
  }
  return false;
}

void MeshStream::FillVertices(v1::MeshVertices* message) {
  const auto vertices = view_.hull->vertices();
  const size_t end = std::min(vertices.size(), next_vertex_ + kVerticesPerMessage);
  message->mutable_xyz()->Reserve(static_cast<int>(3 * (end - next_vertex_)));
  for (; next_vertex_ < end; ++next_vertex_) {
    for (int i = 0; i < 3; ++i) message->add_xyz(vertices[next_vertex_][i]);
  }
}

// Whole facets only; one that is larger than a message makes a message of its own.
void MeshStream::FillFacets(v1::MeshFacets* message) {
  while (next_facet_ < view_.hull->facet_count()) {
    const auto facet = view_.hull->facet(next_facet_);
    const int after =
        message->sizes_size() + 1 + message->indices_size() + static_cast<int>(facet.size());
    if (message->sizes_size() > 0 && after > kIndicesPerMessage) return;
    message->add_sizes(static_cast<uint32_t>(facet.size()));
    for (const uint32_t index : facet) message->add_indices(index);
    ++next_facet_;
  }
}

}  // namespace hulld::server
