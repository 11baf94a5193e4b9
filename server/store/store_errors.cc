#include "server/store/store_errors.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstring>

#include "server/contract/errors.h"

namespace hulld::server {

namespace {

// Returns true if the disk is full, even if only the text of the system's error reports it.
bool ReportsFullDisk(const rocksdb::Status& status) {
  const std::string cause = status.ToString();
  return status.IsNoSpace() || absl::StrContains(cause, std::strerror(ENOSPC)) ||
         absl::StrContains(cause, std::strerror(EDQUOT));
}

// RocksDB names the cause only in text. The path, which may contain anything, follows it; a lock
// file that cannot be opened is another error.
bool IsLocked(const std::string& cause) {
  return absl::StartsWithIgnoreCase(cause, "IO error: While lock file:") ||
         absl::StartsWithIgnoreCase(cause, "IO error: lock hold by current process");
}

absl::Status DiskFull(const std::string& cause, const std::string& data_dir) {
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat(
          "the disk that contains --data-dir ", data_dir, " is full (", cause,
          "); nothing was changed; free disk space, or delete hulls if the server still "
          "accepts that, then retry; no restart is needed")),
      v1::ERROR_REASON_DISK_FULL);
}

std::string Acknowledged(std::optional<uint64_t> revision) {
  if (!revision.has_value()) return "";
  return absl::StrCat("changes up to revision ", *revision, " were acknowledged, and ");
}

}  // namespace

bool IsDiskFull(const absl::Status& status) { return absl::IsResourceExhausted(status); }

absl::Status WriteError(const rocksdb::Status& status, const std::string& data_dir) {
  const std::string cause = status.ToString();
  if (ReportsFullDisk(status)) return DiskFull(cause, data_dir);
  return Unavailable("cannot write to --data-dir ", data_dir, " (", cause,
                     "); nothing was changed; fix the cause, then retry; no restart is needed");
}

absl::Status OutcomeUnknown(const rocksdb::Status& status, const rocksdb::Status& cut,
                            const std::string& data_dir) {
  return Unavailable(
      "cannot write to --data-dir ", data_dir, " (", status.ToString(),
      "), nor roll back the partial write (", cut.ToString(),
      "): the change is not visible, but may appear if the server restarts before the "
      "disk is fixed; check whether it is there before you retry");
}

absl::Status CannotBeRead(const std::string& data_dir) {
  return Unavailable(
      "the store in --data-dir ", data_dir,
      " became unreadable after an error; restart hulld, and run 'hulld doctor' if that fails");
}

absl::Status OpenError(const rocksdb::Status& status, const std::string& data_dir, bool read_only) {
  const std::string cause = status.ToString();
  if (IsLocked(cause)) {
    return absl::FailedPreconditionError(
        absl::StrCat("--data-dir ", data_dir, " is in use by another hulld (", cause,
                     "); stop that server, or use another directory"));
  }
  if (status.IsCorruption()) {
    return absl::DataLossError(absl::StrCat("--data-dir ", data_dir, " is damaged (", cause,
                                            "); restore a backup into another directory, or accept "
                                            "the loss with 'hulld doctor --accept-loss'"));
  }
  if (read_only && (status.IsNotFound() || status.IsPathNotFound() || status.IsInvalidArgument())) {
    return absl::NotFoundError(
        absl::StrCat("--data-dir ", data_dir, " contains no hulld store (", cause, ")"));
  }
  if (ReportsFullDisk(status)) return DiskFull(cause, data_dir);
  return Unavailable("cannot open the store in --data-dir ", data_dir, ": ", cause);
}

absl::Status LogLost(const std::string& data_dir, const std::string& finding,
                     std::optional<uint64_t> revision) {
  return absl::DataLossError(absl::StrCat(
      "--data-dir ", data_dir, " may lack acknowledged changes (", Acknowledged(revision), finding,
      "); nothing was changed; put the file back, restore a backup into another directory, or "
      "accept the loss with 'hulld doctor --accept-loss'"));
}

absl::Status ManifestLost(const std::string& data_dir, const std::string& finding,
                          std::optional<uint64_t> revision) {
  return absl::DataLossError(absl::StrCat(
      "--data-dir ", data_dir, " is damaged (", Acknowledged(revision), finding,
      "); nothing was changed; put the file back, or restore a backup into another directory"));
}

absl::Status DamagedBeyondLog(const rocksdb::Status& status, const std::string& data_dir) {
  return absl::DataLossError(absl::StrCat(
      "--data-dir ", data_dir, " is damaged (", status.ToString(),
      "); not only its log is affected, so its remains cannot be served; restore a backup into "
      "another directory"));
}

absl::Status OtherFormat(const std::string& where, uint64_t found, uint64_t expected) {
  return absl::FailedPreconditionError(absl::StrCat(where, " is in format ", found,
                                                    "; this hulld uses format ", expected,
                                                    "; run the hulld version that wrote it"));
}

absl::Status UnfinishedMigration() {
  return absl::FailedPreconditionError(
      "the migration into it is incomplete; run the same 'hulld migrate' command again to resume "
      "it");
}

absl::Status DamagedHull(const std::string& hull_id, const std::string& finding) {
  return WithReason(absl::DataLossError(absl::StrCat(
                        "hull \"", hull_id, "\" is damaged in the store (", finding,
                        "); delete it and append its points again, or restore a backup")),
                    v1::ERROR_REASON_HULL_DAMAGED, {{"hull_id", hull_id}});
}

absl::Status DamagedBody(const std::string& body_id, const std::string& finding) {
  return WithReason(
      absl::DataLossError(absl::StrCat("body \"", body_id, "\" is damaged in the store (", finding,
                                       "); replace or delete it, or restore a backup")),
      v1::ERROR_REASON_BODY_DAMAGED, {{"body_id", body_id}});
}

}  // namespace hulld::server
