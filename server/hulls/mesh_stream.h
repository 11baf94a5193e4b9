#ifndef HULLD_SERVER_HULLS_MESH_STREAM_H_
#define HULLD_SERVER_HULLS_MESH_STREAM_H_

#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "hulld/v1/hull.pb.h"
#include "server/call/pulled_stream.h"
#include "server/shards/shard_pools.h"
#include "server/shards/shards.h"

namespace hulld::server {

// One GetHullMesh call: a header, then pieces of one snapshot of the hull.
class MeshStream : public RequestStream<PulledStream<WriteReactor, v1::GetHullMeshResponse>,
                                        v1::GetHullMeshRequest> {
 public:
  static WriteReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                             Shards& shards, ShardPools& readers, const grpc::ByteBuffer& request);

 private:
  MeshStream(grpc::CallbackServerContext& context, Admission& admission, Shards& shards,
             ShardPools& readers, const grpc::ByteBuffer& request)
      : RequestStream(request, context, admission, Rpc::kGetHullMesh),
        shards_(shards),
        readers_(readers) {}

  void Open() override;
  void OnSent() override;

  absl::Status MakeHeader();
  absl::Status Simplify(const v1::Simplification& simplification, v1::MeshHeader* header);
  // Fills the reply with the next piece; false when all are sent.
  bool NextMessage();
  void FillVertices(v1::MeshVertices* message);
  void FillFacets(v1::MeshFacets* message);

  Shards& shards_;
  ShardPools& readers_;
  // What is sent: the hull itself, or what stands for it.
  std::shared_ptr<const Hull> mesh_;
  size_t next_vertex_ = 0;
  size_t next_facet_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_MESH_STREAM_H_
