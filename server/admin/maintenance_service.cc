#include "server/admin/maintenance_service.h"

#include "server/admin/snapshot_stream.h"

namespace hulld::server {

grpc::ServerWriteReactor<v1::SaveSnapshotResponse>* MaintenanceService::SaveSnapshot(
    grpc::CallbackServerContext* context, const v1::SaveSnapshotRequest*) {
  return SnapshotStream::Start(*context, admission_, store_, registry_, readers_);
}

}  // namespace hulld::server
