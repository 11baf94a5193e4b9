#ifndef HULLD_SERVER_ADMIN_MAINTENANCE_SERVICE_H_
#define HULLD_SERVER_ADMIN_MAINTENANCE_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include "hulld/v1/maintenance.grpc.pb.h"
#include "server/call/call_stream.h"
#include "server/call/service_parts.h"

namespace hulld::server {

// hulld.v1.MaintenanceService: the contract in maintenance.proto.
class MaintenanceService : public v1::MaintenanceService::WithRawCallbackMethod_SaveBackup<
                               v1::MaintenanceService::Service> {
 public:
  explicit MaintenanceService(const ServiceParts& parts) : parts_(parts) {}

  WriteReactor* SaveBackup(CallContext* context, const Bytes* request) override;

 private:
  const ServiceParts& parts_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_MAINTENANCE_SERVICE_H_
