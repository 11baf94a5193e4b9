#ifndef HULLD_SERVER_STORE_FILES_LOG_MARK_H_
#define HULLD_SERVER_STORE_FILES_LOG_MARK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <rocksdb/file_system.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace hulld::server {

// The high-water mark of the write-ahead logs: a lower bound of their synced bytes. A start
// compares the logs with it before it opens the database, which replays and deletes the logs.
struct LogMark {
  // The first bytes of a log.
  struct Synced {
    uint64_t size = 0;
    uint32_t crc32 = 0;

    friend bool operator==(const Synced&, const Synced&) = default;
  };

  // The store's last acknowledged revision.
  uint64_t revision = 0;
  // The live logs, by their numbers.
  std::map<uint64_t, Synced> logs;

  friend bool operator==(const LogMark&, const LogMark&) = default;
};

// Makes the entries of a directory durable.
rocksdb::IOStatus SyncDirectory(rocksdb::FileSystem& files, const std::string& directory);

// "000012.log" in `directory`, as RocksDB names it.
std::string LogPath(const std::string& directory, uint64_t number);
// Parses such a name; nullopt for any other file.
std::optional<uint64_t> LogNumber(const std::string& path);

// Returns the first log in `directory` that contradicts `mark`, with the finding: it is missing,
// too short, or has different bytes. None if all logs match. UNAVAILABLE: a log cannot be read.
// Cost: reads all bytes covered by the mark.
struct LostLog {
  uint64_t number = 0;
  std::string finding;
};
absl::StatusOr<std::optional<LostLog>> FindLostLog(rocksdb::FileSystem& files,
                                                   const std::string& directory,
                                                   const LogMark& mark);

// The file that keeps the mark. Two slots of one sector each are overwritten in turn, so that one
// is intact after a power failure, and a full disk does not prevent writing.
class LogMarkFile {
 public:
  // Reads the mark; none if the file does not exist. DATA_LOSS: the file contains no mark.
  // UNAVAILABLE: it cannot be read.
  static absl::StatusOr<std::optional<LogMark>> Read(rocksdb::FileSystem& files,
                                                     const std::string& path);
  // Opens the file for writing. Creates it durably, with `mark`, if it does not exist or `replace`
  // is true. Requires: an existing file that is kept contains `mark`.
  static rocksdb::IOStatus Open(rocksdb::FileSystem& files, const std::string& path,
                                const LogMark& mark, bool replace,
                                std::unique_ptr<LogMarkFile>* result);

  // Overwrites the older slot. The result survives a crash of the process; of the machine only
  // after Sync. Not thread-safe.
  rocksdb::IOStatus Write(const LogMark& mark);
  // Any thread.
  rocksdb::IOStatus Sync() { return file_->Sync(rocksdb::IOOptions(), nullptr); }

 private:
  LogMarkFile(std::unique_ptr<rocksdb::FSRandomRWFile> file, uint64_t generation)
      : file_(std::move(file)), generation_(generation) {}

  const std::unique_ptr<rocksdb::FSRandomRWFile> file_;
  uint64_t generation_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_FILES_LOG_MARK_H_
