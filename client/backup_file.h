#ifndef HULLD_CLIENT_BACKUP_FILE_H_
#define HULLD_CLIENT_BACKUP_FILE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <fstream>
#include <string>

#include "hulld/v1/maintenance.pb.h"

namespace hulld {

// A backup of a store in one file: a line that says what it is, then the parts of SaveBackup,
// each after its size and the CRC-32 of its bytes (32 bits each, little endian). The part `end` is
// the last, which reveals a file that was cut short.

// Checks that parts make up a whole backup, in their order.
class BackupCheck {
 public:
  // INVALID_ARGUMENT: the part is damaged, out of place, or has a path that leads elsewhere.
  absl::Status Take(const v1::SaveBackupResponse& part);
  // Whether `end` came.
  bool complete() const { return complete_; }
  // What the backup says of itself, and the sums over the parts so far.
  const v1::BackupBegin& begin() const { return begin_; }
  const v1::BackupEnd& totals() const { return totals_; }

 private:
  absl::Status TakePiece(const v1::BackupPiece& piece);

  bool begun_ = false;
  bool complete_ = false;
  v1::BackupBegin begin_;
  v1::BackupEnd totals_;
  std::string path_;
  uint64_t file_bytes_ = 0;
};

// Writes a backup to a new file, piece by piece. The file gets its name only when it is complete
// and on disk.
class BackupWriter {
 public:
  explicit BackupWriter(std::string path);
  // Removes what is not complete.
  ~BackupWriter();
  BackupWriter(const BackupWriter&) = delete;
  BackupWriter& operator=(const BackupWriter&) = delete;

  absl::Status Open();
  absl::Status Write(const v1::SaveBackupResponse& part);
  // INVALID_ARGUMENT: the backup is not complete, or the file cannot be written.
  absl::Status Finish();
  const BackupCheck& check() const { return check_; }

 private:
  const std::string path_;
  const std::string partial_path_;
  bool opened_ = false;
  std::ofstream file_;
  BackupCheck check_;
};

// A file of this name in a data directory tells hulld that the directory was made from a backup.
// The store that the backup was taken from and the restored one give the same revisions to
// different changes, so hulld gives the restored one an ID of its own.
inline constexpr char kRestoredMark[] = "restored";

// Makes a data directory from a backup: all of it, or no store. The directory need not exist. If it
// does, it must be empty (but for lost+found, and for the remains of a call that was killed), and
// nothing outside it is written. Returns what the backup said of itself; the store that hulld
// makes of the directory has another ID. INVALID_ARGUMENT: the file is no backup, is damaged or
// cut short; FAILED_PRECONDITION: the directory is there and not empty; UNAVAILABLE: it cannot be
// written.
absl::StatusOr<BackupCheck> RestoreBackup(const std::string& path, const std::string& directory);

}  // namespace hulld

#endif  // HULLD_CLIENT_BACKUP_FILE_H_
