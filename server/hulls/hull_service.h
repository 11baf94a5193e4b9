#ifndef HULLD_SERVER_HULLS_HULL_SERVICE_H_
#define HULLD_SERVER_HULLS_HULL_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <memory>

#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.HullService: implements the contract in hull.proto on the registry. Calls that only read
// records are answered on arrival. Calls that need a snapshot run on `readers`; meshes, audits, and
// properties, which may take long, on `long_readers`. Replacements and chunks are built on
// `writers`. Watches read records on notification, and boxes from the store on `readers`. The parts
// must outlive the service.
std::unique_ptr<grpc::Service> MakeHullService(const ServiceParts& parts);

}  // namespace hulld::server

#endif  // HULLD_SERVER_HULLS_HULL_SERVICE_H_
