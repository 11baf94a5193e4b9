#ifndef HULLD_SERVER_HULLS_MESH_STREAM_H_
#define HULLD_SERVER_HULLS_MESH_STREAM_H_

#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <optional>
#include <string>

#include "hulld/v1/hull.pb.h"
#include "server/call/call.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// One GetHullMesh call: one message after the other from one snapshot, the next one made when the
// one before is sent. It owns itself until gRPC is done with it.
class MeshStream : public grpc::ServerWriteReactor<v1::GetHullMeshResponse> {
 public:
  static grpc::ServerWriteReactor<v1::GetHullMeshResponse>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Registry& registry,
      WorkerPool& readers, const v1::GetHullMeshRequest& request);

 private:
  MeshStream(grpc::CallbackServerContext& context, Admission& admission)
      : call_(context, admission, Rpc::kGetHullMesh) {}

  void OnWriteDone(bool ok) override;
  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { delete this; }

  void Open(Registry& registry, const v1::GetHullMeshRequest& request);
  absl::Status Simplify(const v1::Simplification& simplification, v1::MeshHeader* header);
  // Fills message_ with the next piece; false when all are sent.
  bool NextMessage();
  void FillVertices(v1::MeshVertices* message);
  void FillFacets(v1::MeshFacets* message);

  Call call_;
  // What is sent: the hull itself, or what stands for it.
  std::shared_ptr<const Hull> mesh_;
  size_t next_vertex_ = 0;
  size_t next_facet_ = 0;
  v1::GetHullMeshResponse message_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_MESH_STREAM_H_
