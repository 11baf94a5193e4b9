#ifndef HULLD_CLIENT_BACKUP_FILE_H_
#define HULLD_CLIENT_BACKUP_FILE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <fstream>
#include <string>

#include "hulld/v1/maintenance.pb.h"

namespace hulld {

// A backup of a store in one file: a line that identifies the format, then the parts of SaveBackup.
// Each part is preceded by its size and the CRC-32 of its bytes (32 bits each, little endian).
// `end` is the last part, so truncation is detected.

// Checks that parts form a complete backup in order.
class BackupCheck {
 public:
  // INVALID_ARGUMENT: the part is damaged, out of order, or has a path outside the directory.
  absl::Status Take(const v1::SaveBackupResponse& part);
  // Returns true if `end` was received.
  bool complete() const { return complete_; }
  // The backup's header, and the sums over the parts so far.
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

// Writes a backup to a new file, part by part. The file gets its final name when it is complete and
// synced to disk.
class BackupWriter {
 public:
  explicit BackupWriter(std::string path);
  // Removes an incomplete file.
  ~BackupWriter();
  BackupWriter(const BackupWriter&) = delete;
  BackupWriter& operator=(const BackupWriter&) = delete;

  absl::Status Open();
  absl::Status Write(const v1::SaveBackupResponse& part);
  // INVALID_ARGUMENT: the backup is incomplete, or the file cannot be written.
  absl::Status Finish();
  const BackupCheck& check() const { return check_; }

 private:
  const std::string path_;
  const std::string partial_path_;
  bool opened_ = false;
  std::ofstream file_;
  BackupCheck check_;
};

// Name of the file that marks a data directory as restored. The original and the restored store
// assign the same revisions to different changes, so hulld assigns a new ID to a marked store.
inline constexpr char kRestoredMark[] = "restored";

// Creates a data directory from a backup: the complete store, or none. An existing directory must
// be empty, except for lost+found and the remains of a killed call. Writes nothing outside the
// directory. Returns the checked backup. The store that hulld opens there has a new ID.
// INVALID_ARGUMENT: the file is not a backup, or is damaged or truncated. FAILED_PRECONDITION: the
// directory exists and is not empty. UNAVAILABLE: it cannot be written.
absl::StatusOr<BackupCheck> RestoreBackup(const std::string& path, const std::string& directory);

}  // namespace hulld

#endif  // HULLD_CLIENT_BACKUP_FILE_H_
