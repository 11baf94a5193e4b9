#ifndef HULLD_SERVER_HULLS_HULL_SERVICE_H_
#define HULLD_SERVER_HULLS_HULL_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include "hulld/v1/hull.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call.h"
#include "server/call/unary_call.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"

namespace hulld::server {

// hulld.v1.HullService: the contract in hull.proto over the registry. Calls that only look into
// records are answered where they arrive; those that need a snapshot, on `readers`,
// meshes and audits, which may take long, on `long_readers`, and replacements are built on
// `writers`, as the registry builds chunks.
// Watches look into records where they are told of changes, and read boxes from the store on
// `readers`.
class HullService : public v1::HullService::CallbackService {
 public:
  HullService(Registry& registry, Admission& admission, WorkerPool& writers, WorkerPool& readers,
              WorkerPool& long_readers)
      : registry_(registry),
        admission_(admission),
        writers_(writers),
        readers_(readers),
        long_readers_(long_readers) {}

  grpc::ServerUnaryReactor* CreateHull(grpc::CallbackServerContext* context,
                                       const v1::CreateHullRequest* request,
                                       v1::CreateHullResponse* response) override;
  grpc::ServerBidiReactor<v1::AppendPointsRequest, v1::AppendPointsResponse>* AppendPoints(
      grpc::CallbackServerContext* context) override;
  grpc::ServerReadReactor<v1::ReplaceHullRequest>* ReplaceHull(
      grpc::CallbackServerContext* context, v1::ReplaceHullResponse* response) override;
  grpc::ServerUnaryReactor* GetHull(grpc::CallbackServerContext* context,
                                    const v1::GetHullRequest* request,
                                    v1::GetHullResponse* response) override;
  grpc::ServerWriteReactor<v1::GetHullMeshResponse>* GetHullMesh(
      grpc::CallbackServerContext* context, const v1::GetHullMeshRequest* request) override;
  grpc::ServerUnaryReactor* ListHulls(grpc::CallbackServerContext* context,
                                      const v1::ListHullsRequest* request,
                                      v1::ListHullsResponse* response) override;
  grpc::ServerUnaryReactor* DeleteHull(grpc::CallbackServerContext* context,
                                       const v1::DeleteHullRequest* request,
                                       v1::DeleteHullResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchHullsResponse>* WatchHulls(
      grpc::CallbackServerContext* context, const v1::WatchHullsRequest* request) override;

 private:
  // Create and Delete end the call once the change is committed.
  void Create(const v1::CreateHullRequest& request, v1::CreateHullResponse* response,
              UnaryCall* call);
  absl::Status Get(const v1::GetHullRequest& request, const Call& call,
                   v1::GetHullResponse* response);
  absl::Status List(const v1::ListHullsRequest& request, const Call& call,
                    v1::ListHullsResponse* response);
  void Delete(const v1::DeleteHullRequest& request, v1::DeleteHullResponse* response,
              UnaryCall* call);

  Registry& registry_;
  Admission& admission_;
  WorkerPool& writers_;
  WorkerPool& readers_;
  WorkerPool& long_readers_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_HULL_SERVICE_H_
