#ifndef HULLD_SERVER_ADMIN_ADMIN_SERVICES_H_
#define HULLD_SERVER_ADMIN_ADMIN_SERVICES_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "server/call/admission.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.StatusService: the contract in status.proto. The parts must outlive the service.
std::unique_ptr<grpc::Service> MakeStatusService(const ServiceParts& parts);

// hulld.v1.MaintenanceService: the contract in maintenance.proto. The parts must outlive the
// service.
std::unique_ptr<grpc::Service> MakeMaintenanceService(const ServiceParts& parts);

// grpc.reflection.v1alpha.ServerReflection: lists the services for tools such as grpcurl. It needs
// no token, because the contract is not secret. Its streams count toward --max-streams-per-client
// and occupy no thread while they wait. services: full names of the services to list. The admission
// must outlive the service.
std::unique_ptr<grpc::Service> MakeReflectionService(Admission& admission,
                                                     std::vector<std::string> services);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_ADMIN_SERVICES_H_
