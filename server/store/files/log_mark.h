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

// The high-water mark of the write-ahead logs and of the manifest, which names the tables: a lower
// bound on their synced bytes. A starting server compares the files with the mark before it opens
// the database, which replays and deletes the logs, and deletes tables that no manifest names.
struct LogMark {
  // Size and checksum of a prefix of a file.
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
  // The number of the manifest named by CURRENT, and its synced bytes. 0: unknown, in a mark of an
  // earlier version.
  uint64_t manifest = 0;
  Synced manifest_synced;
};

// Makes the entries of a directory durable.
rocksdb::IOStatus SyncDirectory(rocksdb::FileSystem& files, const std::string& directory);

// "000012.log" in `directory`, as RocksDB names it.
std::string LogPath(const std::string& directory, uint64_t number);
// Parses such a name; nullopt for any other file.
std::optional<uint64_t> LogNumber(const std::string& path);

// "MANIFEST-000010" in `directory`, as RocksDB names it.
std::string ManifestPath(const std::string& directory, uint64_t number);
// Parses such a name; nullopt for any other file.
std::optional<uint64_t> ManifestNumber(const std::string& path);
// "CURRENT" in `directory`, which names the manifest.
std::string CurrentPath(const std::string& directory);
// Returns the number of the manifest that CURRENT names; nullopt if CURRENT is damaged. NOT_FOUND:
// CURRENT does not exist. UNAVAILABLE: it cannot be read.
absl::StatusOr<std::optional<uint64_t>> ReadCurrent(rocksdb::FileSystem& files,
                                                    const std::string& directory);

// Returns a finding if CURRENT or the manifest that it names is missing, damaged, or contradicts
// `mark`; empty if both are sound, or if `directory` contains no database and there is no mark.
// RocksDB would otherwise create an empty database, or open part of one, and delete the tables.
// UNAVAILABLE: a file cannot be read.
absl::StatusOr<std::string> FindLostManifest(rocksdb::FileSystem& files,
                                             const std::string& directory,
                                             const std::optional<LogMark>& mark);

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
