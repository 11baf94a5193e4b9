#include "server/admin/maintenance_service.h"

#include "server/admin/backup_stream.h"

namespace hulld::server {

WriteReactor* MaintenanceService::SaveBackup(CallContext* context, const Bytes* request) {
  return BackupStream::Launch(
      std::make_shared<BackupStream>(*context, admission_, store_, registry_, readers_, *request));
}

}  // namespace hulld::server
