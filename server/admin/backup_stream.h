#ifndef HULLD_SERVER_ADMIN_BACKUP_STREAM_H_
#define HULLD_SERVER_ADMIN_BACKUP_STREAM_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "hulld/v1/maintenance.pb.h"
#include "server/call/call.h"
#include "server/process/worker_pool.h"
#include "server/registry/registry.h"
#include "server/store/store.h"

namespace hulld::server {

// One SaveBackup call: makes a copy of the store, sends its files piece by piece, each read when
// the one before is sent, and removes the copy. It owns itself until gRPC is done with it.
class BackupStream : public grpc::ServerWriteReactor<v1::SaveBackupResponse> {
 public:
  static grpc::ServerWriteReactor<v1::SaveBackupResponse>* Start(
      grpc::CallbackServerContext& context, Admission& admission, Store& store,
      const Registry& registry, WorkerPool& readers);

 private:
  BackupStream(grpc::CallbackServerContext& context, Admission& admission, WorkerPool& readers)
      : readers_(readers), call_(context, admission, Rpc::kSaveBackup) {}
  ~BackupStream() override;

  void OnWriteDone(bool ok) override;
  void OnCancel() override { call_.Cancel(); }
  void OnDone() override { delete this; }

  void Open(Store& store, const Registry& registry);
  void SendNext();
  // Fills message_ with the next part; false when all are sent.
  absl::StatusOr<bool> NextMessage();
  absl::StatusOr<bool> NextPiece();

  WorkerPool& readers_;
  Call call_;
  std::string directory_;
  // Relative to directory_; the last is sent first.
  std::vector<std::string> files_;
  std::ifstream file_;
  uint64_t offset_ = 0;
  v1::BackupEnd totals_;
  bool ended_ = false;
  v1::SaveBackupResponse message_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_BACKUP_STREAM_H_
