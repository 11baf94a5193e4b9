#ifndef HULLD_SERVER_BODIES_BODY_SERVICE_H_
#define HULLD_SERVER_BODIES_BODY_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include <memory>

#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.BodyService: implements the contract in body.proto on the registry. Calls that only read
// records are answered on arrival. Calls that involve pieces, possibly many, run on `readers`. The
// parts must outlive the service.
std::unique_ptr<grpc::Service> MakeBodyService(const ServiceParts& parts);

}  // namespace hulld::server

#endif  // HULLD_SERVER_BODIES_BODY_SERVICE_H_
