#ifndef HULLD_SERVER_STORE_LOG_FILE_SYSTEM_H_
#define HULLD_SERVER_STORE_LOG_FILE_SYSTEM_H_

#include <rocksdb/file_system.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace hulld::server {

// A file system that knows how much of RocksDB's write-ahead logs is committed, so that what a
// failed write left at their end can be cut off: a change that was refused must not appear when
// the log is read again. A log that is cut while RocksDB has it open takes nothing more.
//
// It also hides how much room the disk has, on which RocksDB would resume by itself after an error
// and write to a log that failed.
class LogFileSystem : public rocksdb::FileSystemWrapper {
 public:
  // directory: where the logs are; copies of them elsewhere are not meant.
  LogFileSystem(const std::shared_ptr<rocksdb::FileSystem>& base, std::string directory)
      : FileSystemWrapper(base), directory_(std::move(directory)) {}
  const char* Name() const override { return "LogFileSystem"; }

  // Everything that was written to the logs so far is committed.
  void Commit();
  // Syncs of files and directories that failed so far: RocksDB also refuses to write after one in
  // the background.
  uint64_t failed_syncs() const { return failed_syncs_.load(std::memory_order_relaxed); }
  // Cuts off what is not, and syncs that. Requires that nothing is written to the logs meanwhile
  // (unchecked: RocksDbStore, the one caller, holds its log_mutex_, or has closed the database).
  // An error: it may still be there, and the next call tries again.
  rocksdb::IOStatus CutUncommitted();

  rocksdb::IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewDirectory(const std::string& name, const rocksdb::IOOptions& options,
                                 std::unique_ptr<rocksdb::FSDirectory>* result,
                                 rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus DeleteFile(const std::string& name, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus GetFreeSpace(const std::string& path, const rocksdb::IOOptions& options,
                                 uint64_t* bytes, rocksdb::IODebugContext* debug) override;

 private:
  class File;
  class Directory;
  class Log;
  struct LogState {
    uint64_t written = 0;
    uint64_t committed = 0;
    // Null once RocksDB has closed it.
    Log* open = nullptr;
  };

  rocksdb::IOStatus NoteSync(const rocksdb::IOStatus& status);
  rocksdb::IOStatus Cut(const std::string& name, const LogState& log);

  const std::string directory_;
  std::atomic<uint64_t> failed_syncs_ = 0;
  std::mutex mutex_;
  std::map<std::string, LogState> logs_;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_LOG_FILE_SYSTEM_H_
