#ifndef HULLD_SERVER_STORE_STORE_ERRORS_H_
#define HULLD_SERVER_STORE_STORE_ERRORS_H_

#include <absl/status/status.h>
#include <rocksdb/status.h>

#include <cstdint>
#include <optional>
#include <string>

// Converts RocksDB's errors into statuses for clients, with a remedy. data_dir: the setting.
namespace hulld::server {

// For a failed write that left nothing behind. RESOURCE_EXHAUSTED: the disk is full. UNAVAILABLE:
// any other cause.
absl::Status WriteError(const rocksdb::Status& status, const std::string& data_dir);
// UNAVAILABLE: a write failed, and cutting its remains off the log failed, too (`cut`).
absl::Status OutcomeUnknown(const rocksdb::Status& status, const rocksdb::Status& cut,
                            const std::string& data_dir);
// UNAVAILABLE: the database could not be reopened after an error, not even for reading.
absl::Status CannotBeRead(const std::string& data_dir);
// For a database that could not be opened. FAILED_PRECONDITION: another process has it open.
// DATA_LOSS: it is damaged. NOT_FOUND: read_only, and the store does not exist.
// RESOURCE_EXHAUSTED: the disk is full. UNAVAILABLE: any other cause.
absl::Status OpenError(const rocksdb::Status& status, const std::string& data_dir, bool read_only);
// True for the error that WriteError and OpenError return for a full disk.
bool IsDiskFull(const absl::Status& status);
// DATA_LOSS: the logs lack acknowledged changes, which reached this revision if it is known.
// finding: names the file.
absl::Status LogLost(const std::string& data_dir, const std::string& finding,
                     std::optional<uint64_t> revision);
// DATA_LOSS: the manifest or CURRENT is lost, so the tables cannot be found; otherwise as LogLost.
absl::Status ManifestLost(const std::string& data_dir, const std::string& finding,
                          std::optional<uint64_t> revision);
// DATA_LOSS: a store is damaged beyond the loss that 'hulld doctor' accepted.
absl::Status DamagedBeyondLog(const rocksdb::Status& status, const std::string& data_dir);
// FAILED_PRECONDITION: a store is in a format that this hulld does not read. where: names the
// store.
absl::Status OtherFormat(const std::string& where, uint64_t found, uint64_t expected);
// FAILED_PRECONDITION: a migration to this store is unfinished.
absl::Status UnfinishedMigration();
// DATA_LOSS: the stored hull, or body, is damaged. finding: the damage.
absl::Status DamagedHull(const std::string& hull_id, const std::string& finding);
absl::Status DamagedBody(const std::string& body_id, const std::string& finding);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_STORE_ERRORS_H_
