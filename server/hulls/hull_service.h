#ifndef HULLD_SERVER_HULLS_HULL_SERVICE_H_
#define HULLD_SERVER_HULLS_HULL_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include "hulld/v1/hull.grpc.pb.h"
#include "server/call/call.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"
#include "server/call/unary_call.h"

namespace hulld::server {

// The generated service, with methods that exchange bytes (message_bytes.h).
using HullServiceOfBytes = v1::HullService::WithRawCallbackMethod_CreateHull<
    v1::HullService::WithRawCallbackMethod_AppendPoints<
        v1::HullService::WithRawCallbackMethod_ReplaceHull<
            v1::HullService::WithRawCallbackMethod_GetHull<
                v1::HullService::WithRawCallbackMethod_GetHullMesh<
                    v1::HullService::WithRawCallbackMethod_ListHulls<
                        v1::HullService::WithRawCallbackMethod_DeleteHull<
                            v1::HullService::WithRawCallbackMethod_WatchHulls<
                                v1::HullService::Service>>>>>>>>;

// hulld.v1.HullService: implements the contract in hull.proto on the registry. Calls that only read
// records are answered on arrival. Calls that need a snapshot run on `readers`; meshes, audits, and
// properties, which may take long, on `long_readers`. Replacements and chunks are built on
// `writers`. Watches read records on notification, and boxes from the store on `readers`.
class HullService : public HullServiceOfBytes {
 public:
  explicit HullService(const ServiceParts& parts) : parts_(parts) {}

  UnaryReactor* CreateHull(CallContext* context, const Bytes* request, Bytes* response) override;
  BidiReactor* AppendPoints(CallContext* context) override;
  ReadReactor* ReplaceHull(CallContext* context, Bytes* response) override;
  UnaryReactor* GetHull(CallContext* context, const Bytes* request, Bytes* response) override;
  WriteReactor* GetHullMesh(CallContext* context, const Bytes* request) override;
  UnaryReactor* ListHulls(CallContext* context, const Bytes* request, Bytes* response) override;
  UnaryReactor* DeleteHull(CallContext* context, const Bytes* request, Bytes* response) override;
  WriteReactor* WatchHulls(CallContext* context, const Bytes* request) override;

 private:
  using CreateCall = UnaryCall<v1::CreateHullRequest, v1::CreateHullResponse>;
  using GetCall = UnaryCall<v1::GetHullRequest, v1::GetHullResponse>;
  using ListCall = UnaryCall<v1::ListHullsRequest, v1::ListHullsResponse>;
  using DeleteCall = UnaryCall<v1::DeleteHullRequest, v1::DeleteHullResponse>;

  // Ends the call after the change is committed.
  void Create(CreateCall* call);
  absl::Status Get(const v1::GetHullRequest& request, const Call& call,
                   v1::GetHullResponse* response);

  const ServiceParts& parts_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_HULL_SERVICE_H_
