#ifndef HULLD_SERVER_ADMIN_MAINTENANCE_SERVICE_H_
#define HULLD_SERVER_ADMIN_MAINTENANCE_SERVICE_H_

#include <grpcpp/grpcpp.h>

#include "hulld/v1/maintenance.grpc.pb.h"
#include "server/call/admission.h"
#include "server/call/call_stream.h"
#include "server/process/task_pool.h"
#include "server/registry/registry.h"
#include "server/store/store.h"

namespace hulld::server {

// hulld.v1.MaintenanceService: the contract in maintenance.proto.
class MaintenanceService : public v1::MaintenanceService::WithRawCallbackMethod_SaveBackup<
                               v1::MaintenanceService::Service> {
 public:
  // Backups are read on `readers`. All must outlive this.
  MaintenanceService(Store& store, const Registry& registry, Admission& admission,
                     TaskPool& readers)
      : store_(store), registry_(registry), admission_(admission), readers_(readers) {}

  WriteReactor* SaveBackup(CallContext* context, const Bytes* request) override;

 private:
  Store& store_;
  const Registry& registry_;
  Admission& admission_;
  TaskPool& readers_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_MAINTENANCE_SERVICE_H_
