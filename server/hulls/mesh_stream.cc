#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "core/hull/simplification/simplify.h"
#include "hulld/v1/hull.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/contract/errors.h"
#include "server/hulls/hull_service.h"
#include "server/settings/config.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"

namespace hulld::server {
namespace {

constexpr size_t kVerticesPerMessage = Config::kReplyMessageBytes / (3 * sizeof(double));
// An index takes at most 5 bytes.
constexpr int kIndicesPerMessage = Config::kReplyMessageBytes / 5;

// A GetHullMesh call: a header, then pieces of a single snapshot of the hull.
class MeshStream : public RequestStream<PulledStream<WriteReactor, v1::GetHullMeshResponse>,
                                        v1::GetHullMeshRequest> {
 public:
  MeshStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
      : RequestStream(request, context, parts.admission, Rpc::kGetHullMesh), parts_(parts) {}

 private:
  void Open() override {
    RunOn(parts_.long_readers, [this] {
      const absl::Status made = MakeHeader();
      if (call().ShouldStop()) return FinishCall(call().StopStatus());
      if (!made.ok()) return FinishCall(made);
      Send();
    });
  }

  void OnSent() override {
    if (!NextMessage()) return FinishCall(absl::OkStatus());
    Send();
  }

  absl::Status MakeHeader() {
    HULLD_RETURN_IF_ERROR(CheckHullId(call().caller(), request().hull_id(), "hull_id"));
    const auto should_stop = call().should_stop();
    HULLD_ASSIGN_OR_RETURN(const Freshness freshness,
                           DecodeFreshness(request().freshness(), parts_.store, call().arrival()));
    HULLD_ASSIGN_OR_RETURN(const auto resolved,
                           parts_.registry.Resolve(request().hull_id(), should_stop, freshness));
    HULLD_ASSIGN_OR_RETURN(const Hull* hull,
                           parts_.registry.reader().Canonical(resolved.second, should_stop));
    mesh_ = std::shared_ptr<const Hull>(resolved.second.served, hull);
    v1::MeshHeader* header = reply().mutable_header();
    if (request().has_simplification()) {
      const absl::Status simplified = Simplify(request().simplification(), header);
      if (!simplified.ok()) return Prefixed("simplification: ", simplified);
    }
    EncodeHeader(parts_.store, resolved.first, header->mutable_header());
    EncodeRecord(resolved.second.record, header->mutable_hull());
    header->set_facet_count(mesh_->facet_count());
    header->set_vertex_count(mesh_->vertices().size());
    return absl::OkStatus();
  }

  absl::Status Simplify(const v1::Simplification& simplification, v1::MeshHeader* header) {
    const SimplifyTarget target = {static_cast<size_t>(simplification.max_vertices()),
                                   simplification.max_error(), call().should_stop()};
    const bool is_inside = simplification.side() == v1::SIMPLIFICATION_SIDE_INSIDE;
    if (!is_inside && simplification.side() != v1::SIMPLIFICATION_SIDE_OUTSIDE) {
      return InvalidArgument("side must be INSIDE or OUTSIDE");
    }
    HULLD_ASSIGN_OR_RETURN(SimplifiedHull simplified, is_inside ? SimplifyInside(*mesh_, target)
                                                                : SimplifyOutside(*mesh_, target));
    header->set_error(simplified.error);
    mesh_ = std::make_shared<const Hull>(std::move(simplified.hull));
    return absl::OkStatus();
  }

  // Fills the reply with the next piece; returns false after the last one.
  bool NextMessage() {
    reply().Clear();
    if (next_vertex_ < mesh_->vertices().size()) {
      FillVertices(reply().mutable_vertices());
      return true;
    }
    if (next_facet_ < mesh_->facet_count()) {
      FillFacets(reply().mutable_facets());
      return true;
    }
    return false;
  }

  void FillVertices(v1::MeshVertices* message) {
    const auto vertices = mesh_->vertices();
    const size_t end = std::min(vertices.size(), next_vertex_ + kVerticesPerMessage);
    message->mutable_xyz()->Reserve(static_cast<int>(3 * (end - next_vertex_)));
    for (; next_vertex_ < end; ++next_vertex_) {
      for (int i = 0; i < 3; ++i) message->add_xyz(vertices[next_vertex_][i]);
    }
  }

  // Adds only whole facets; a facet larger than a message gets its own message.
  void FillFacets(v1::MeshFacets* message) {
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

  const ServiceParts& parts_;
  // The hull to send, or its simplification.
  std::shared_ptr<const Hull> mesh_;
  size_t next_vertex_ = 0;
  size_t next_facet_ = 0;
};

}  // namespace

WriteReactor* StartMesh(CallContext& context, const ServiceParts& parts, const Bytes& request) {
  return MeshStream::Launch(std::make_shared<MeshStream>(context, parts, request));
}

}  // namespace hulld::server
