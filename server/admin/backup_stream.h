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
#include "server/registry/registry.h"
#include "server/store/store.h"

namespace hulld::server {

// One SaveBackup call: makes a copy of the store, sends its files in pieces, and removes the copy.
// Each piece is read after the previous one was sent.
class BackupStream : public RequestStream<PulledStream<WriteReactor, v1::SaveBackupResponse>,
                                          v1::SaveBackupRequest> {
 public:
  // Removes the copy.
  ~BackupStream() override;

  BackupStream(CallContext& context, Admission& admission, Store& store, const Registry& registry,
               WorkerPool& readers, const Bytes& request)
      : RequestStream(request, context, admission, Rpc::kSaveBackup),
        store_(store),
        registry_(registry),
        readers_(readers) {}

 private:
  void Open() override;
  void OnSent() override;

  // Makes the copy, and the first message.
  absl::Status Begin();
  // Fills the reply with the next part. Returns false after the last one.
  absl::StatusOr<bool> NextMessage();
  absl::StatusOr<bool> NextPiece();

  Store& store_;
  const Registry& registry_;
  WorkerPool& readers_;
  std::string directory_;
  // Paths relative to directory_. The last one is sent first.
  std::vector<std::string> files_;
  std::ifstream file_;
  uint64_t offset_ = 0;
  v1::BackupEnd totals_;
  bool ended_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_ADMIN_BACKUP_STREAM_H_
