#ifndef HULLD_SERVER_STORE_FILES_LOG_MARK_H_
#define HULLD_SERVER_STORE_FILES_LOG_MARK_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <rocksdb/file_system.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace hulld::server {

// The high-water mark of the write-ahead logs: a lower bound on their synced bytes. A starting
// server compares the logs with the mark before it opens the database, which replays and deletes
// the logs.
struct LogMark {
  // Size and checksum of a prefix of a log.
  struct Synced {
    uint64_t size = 0;
    uint32_t crc32 = 0;

    friend bool operator==(const Synced&, const Synced&) = default;
  };

  // Number of times that the mark was written.
  uint64_t generation = 0;
  // The store's last acknowledged revision.
  uint64_t revision = 0;
  // The live logs, by their numbers.
  std::map<uint64_t, Synced> logs;
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

// Reads the mark; nullopt if the file does not exist. DATA_LOSS: the file contains no intact mark.
// UNAVAILABLE: it cannot be read. The file has two slots of one sector each, overwritten in turn:
// one is intact after a power failure, and a full disk does not prevent writing.
absl::StatusOr<std::optional<LogMark>> ReadLogMark(rocksdb::FileSystem& files,
                                                   const std::string& path);
// Creates the file durably, or replaces it.
rocksdb::IOStatus MakeLogMark(rocksdb::FileSystem& files, const std::string& path,
                              const LogMark& mark);
// Overwrites the older slot. Requires: the generation is one above that of the last write. The
// result survives a crash of the process, but a crash of the machine only after a sync.
rocksdb::IOStatus WriteLogMark(rocksdb::FSRandomRWFile& file, const LogMark& mark);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_FILES_LOG_MARK_H_
