#ifndef HULLD_SERVER_STORE_STORE_ERRORS_H_
#define HULLD_SERVER_STORE_STORE_ERRORS_H_

#include <absl/status/status.h>
#include <rocksdb/status.h>

#include <string>

// What RocksDB's errors mean for those who called hulld, and what they can do. data_dir: the
// setting's value.
namespace hulld::server {

// A write failed, and nothing is left of it. RESOURCE_EXHAUSTED: the disk is full. UNAVAILABLE:
// anything else.
absl::Status WriteError(const rocksdb::Status& status, const std::string& data_dir);
// UNAVAILABLE: a write failed, and so did taking back what it may have left in the log (`cut`).
absl::Status OutcomeUnknown(const rocksdb::Status& status, const rocksdb::Status& cut,
                            const std::string& data_dir);
// A read failed. DATA_LOSS: what was read is damaged. UNAVAILABLE: anything else. what: what was
// tried.
absl::Status ReadError(const rocksdb::Status& status, const std::string& what);
// UNAVAILABLE: the database could not be opened again after an error, not even for reading.
absl::Status CannotBeRead(const std::string& data_dir);
// The database could not be opened. FAILED_PRECONDITION: another process has it open. DATA_LOSS: it
// is damaged. NOT_FOUND: read_only, and there is none. UNAVAILABLE: anything else.
absl::Status OpenError(const rocksdb::Status& status, const std::string& data_dir, bool read_only);
// FAILED_PRECONDITION: a migration has not copied all of its source there yet, so nobody is served
// from it.
absl::Status UnfinishedMigration();
// DATA_LOSS: what is kept of this hull is damaged. finding: what is wrong with it.
absl::Status DamagedHull(const std::string& hull_id, const std::string& finding);
absl::Status DamagedBody(const std::string& body_id, const std::string& finding);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_STORE_ERRORS_H_
