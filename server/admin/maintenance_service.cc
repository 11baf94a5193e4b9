#include "server/admin/maintenance_service.h"

#include "server/admin/backup_stream.h"

namespace hulld::server {

WriteReactor* MaintenanceService::SaveBackup(grpc::CallbackServerContext* context,
                                             const grpc::ByteBuffer* request) {
  return BackupStream::Start(*context, admission_, store_, registry_, readers_, *request);
}

}  // namespace hulld::server
