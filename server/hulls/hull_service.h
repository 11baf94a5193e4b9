#ifndef HULLD_SERVER_HULLS_HULL_SERVICE_H_
#define HULLD_SERVER_HULLS_HULL_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <memory>

#include "server/call/message_bytes.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.HullService: implements the contract in hull.proto on the registry. Calls that only read
// records are answered on arrival. Calls that need a snapshot run on `readers`; meshes, audits, and
// properties, which may take long, on `long_readers`. Replacements and chunks are built on
// `writers`. Watches read records on notification, and boxes from the store on `readers`. The parts
// must outlive the service.
std::unique_ptr<grpc::Service> MakeHullService(const ServiceParts& parts);

// hulld.v1.BodyService: implements the contract in body.proto on the registry. Calls that only read
// records are answered on arrival. Calls that involve pieces, possibly many, run on `readers`. The
// parts must outlive the service.
std::unique_ptr<grpc::Service> MakeBodyService(const ServiceParts& parts);

// The streaming calls of HullService. Each function starts a call and returns its reactor, which
// owns itself until gRPC releases it. request, response: owned by gRPC until the call ends.
BidiReactor* StartAppend(CallContext& context, const ServiceParts& parts);
ReadReactor* StartReplace(CallContext& context, const ServiceParts& parts, Bytes* response);
WriteReactor* StartMesh(CallContext& context, const ServiceParts& parts, const Bytes& request);
WriteReactor* StartWatch(CallContext& context, const ServiceParts& parts, const Bytes& request);

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_HULL_SERVICE_H_
