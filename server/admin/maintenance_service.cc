#include "server/admin/maintenance_service.h"

#include "server/admin/backup_stream.h"

namespace hulld::server {

grpc::ServerWriteReactor<v1::SaveBackupResponse>* MaintenanceService::SaveBackup(
    grpc::CallbackServerContext* context, const v1::SaveBackupRequest*) {
  return BackupStream::Start(*context, admission_, store_, registry_, readers_);
}

}  // namespace hulld::server
