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
#include "server/call/pulled_stream.h"
#include "server/process/worker_pool.h"
#include "server/shards/shards.h"
#include "server/store/store.h"

namespace hulld::server {

// One SaveBackup call: makes a copy of the store, sends its files piece by piece, each read when
// the one before is sent, and removes the copy.
class BackupStream : public RequestStream<PulledStream<WriteReactor, v1::SaveBackupResponse>,
                                          v1::SaveBackupRequest> {
 public:
  // Removes the copy.
  ~BackupStream() override;

  static WriteReactor* Start(grpc::CallbackServerContext& context, Admission& admission,
                             Store& store, const Shards& shards, WorkerPool& readers,
                             const grpc::ByteBuffer& request);

 private:
  BackupStream(grpc::CallbackServerContext& context, Admission& admission, Store& store,
               const Shards& shards, WorkerPool& readers, const grpc::ByteBuffer& request)
      : RequestStream(request, context, admission, Rpc::kSaveBackup),
        store_(store),
        shards_(shards),
        readers_(readers) {}

  void Open() override;
  void OnSent() override;

  // Makes the copy, and the message that precedes its files.
  absl::Status Begin();
  // Fills the reply with the next part; false when all are sent.
  absl::StatusOr<bool> NextMessage();
  absl::StatusOr<bool> NextPiece();

  Store& store_;
  const Shards& shards_;
  WorkerPool& readers_;
  std::string directory_;
  // Relative to directory_; the last is sent first.
  std::vector<std::string> files_;
  std::ifstream file_;
  uint64_t offset_ = 0;
  v1::BackupEnd totals_;
  bool ended_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_BACKUP_STREAM_H_
