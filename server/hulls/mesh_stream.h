#ifndef HULLD_SERVER_HULLS_MESH_STREAM_H_
#define HULLD_SERVER_HULLS_MESH_STREAM_H_

#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <memory>

#include "hulld/v1/hull.pb.h"
#include "server/call/pulled_stream.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// A GetHullMesh call: a header, then pieces of a single snapshot of the hull.
class MeshStream : public RequestStream<PulledStream<WriteReactor, v1::GetHullMeshResponse>,
                                        v1::GetHullMeshRequest> {
 public:
  MeshStream(CallContext& context, const ServiceParts& parts, const Bytes& request)
      : RequestStream(request, context, parts.admission, Rpc::kGetHullMesh), parts_(parts) {}

 private:
  void Open() override;
  void OnSent() override;

  absl::Status MakeHeader();
  absl::Status Simplify(const v1::Simplification& simplification, v1::MeshHeader* header);
  // Fills the reply with the next piece; returns false after the last one.
  bool NextMessage();
  void FillVertices(v1::MeshVertices* message);
  void FillFacets(v1::MeshFacets* message);

  const ServiceParts& parts_;
  // The hull to send, or its simplification.
  std::shared_ptr<const Hull> mesh_;
  size_t next_vertex_ = 0;
  size_t next_facet_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_MESH_STREAM_H_
