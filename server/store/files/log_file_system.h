#ifndef HULLD_SERVER_STORE_FILES_LOG_FILE_SYSTEM_H_
#define HULLD_SERVER_STORE_FILES_LOG_FILE_SYSTEM_H_

#include <rocksdb/file_system.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/store/files/log_mark.h"

namespace hulld::server {

// A file system that tracks the committed part of each of RocksDB's write-ahead logs.
//
// After a failed write, the uncommitted end of the log can be truncated, because a refused change
// must not reappear when the log is replayed. A log that is truncated while RocksDB has it open
// accepts no more writes.
//
// A mark (log_mark.h) records the committed part that is on disk, so that the next start detects a
// log that lost some of it. The mark costs one write of 512 bytes to the page cache for each
// commit, and no sync: it is synced in the background and before a log is deleted. The mark also
// covers the manifest.
//
// Locks the directory of the logs in addition to RocksDB's lock file, which a user may delete, and
// which does not exclude the same process if it names the file differently.
//
// Hides the free space of the disk from RocksDB, which would otherwise resume after an error and
// write to a failed log.
class LogFileSystem : public rocksdb::FileSystemWrapper {
 public:
  // directory: contains the logs. Copies of logs elsewhere are ordinary files.
  LogFileSystem(const std::shared_ptr<rocksdb::FileSystem>& base, std::string directory)
      : FileSystemWrapper(base), directory_(std::move(directory)) {}
  const char* Name() const override { return "LogFileSystem"; }

  // Sets the callback that runs each time the database's lock is acquired, before any other
  // operation; if it fails, the lock is released. Call before the first lock.
  void OnLocked(std::function<rocksdb::IOStatus()> locked) { locked_ = std::move(locked); }

  // Keeps the mark in the existing file at this path. mark: the file's current content.
  rocksdb::IOStatus ResumeMark(const std::string& path, LogMark mark);
  // Keeps the mark in a new file, which replaces any other. Requires: all committed bytes are on
  // disk.
  rocksdb::IOStatus StartMark(const std::string& path, uint64_t revision);
  bool keeps_mark() const;

  // Records that everything written to the logs so far is committed. is_synced: it is also on disk,
  // up to this revision of the store.
  void Commit(uint64_t revision, bool is_synced);
  // Syncs the mark to disk if it changed since the last sync.
  rocksdb::IOStatus SyncMark();

  // Number of failed syncs of files and directories. RocksDB refuses writes after any of them, even
  // one in the background.
  uint64_t failed_syncs() const { return failed_syncs_.load(std::memory_order_relaxed); }
  // Truncates all uncommitted bytes and syncs the logs. Requires: no concurrent writes to the logs
  // (unchecked: RocksDbStore, the only caller, holds its log_mutex_ or has closed the database). On
  // error, some bytes may remain, and the next call tries again.
  rocksdb::IOStatus CutUncommitted();

  rocksdb::IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewDirectory(const std::string& name, const rocksdb::IOOptions& options,
                                 std::unique_ptr<rocksdb::FSDirectory>* result,
                                 rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus RenameFile(const std::string& from, const std::string& to,
                               const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus DeleteFile(const std::string& name, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus LockFile(const std::string& name, const rocksdb::IOOptions& options,
                             rocksdb::FileLock** lock, rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus UnlockFile(rocksdb::FileLock* lock, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus GetFreeSpace(const std::string& path, const rocksdb::IOOptions& options,
                                 uint64_t* bytes, rocksdb::IODebugContext* debug) override;

 private:
  class File;
  class Directory;
  class Log;
  class Manifest;
  struct LogState {
    LogMark::Synced written;
    LogMark::Synced committed;
    // Null once RocksDB has closed it.
    Log* open = nullptr;
  };

  bool IsLog(const std::string& name) const;
  rocksdb::IOStatus LockDirectory();
  void UnlockDirectory();
  rocksdb::IOStatus NoteSync(const rocksdb::IOStatus& status);
  rocksdb::IOStatus Cut(const std::string& name, const LogState& log);
  // Adds the synced bytes of a manifest to the mark if CURRENT names it.
  void NoteManifest(uint64_t number, const LogMark::Synced& synced);
  // Puts a manifest that CURRENT newly names into the mark. Call after the directory was synced.
  void NoteCurrent();
  // Removes a log from the mark, before the log is deleted.
  rocksdb::IOStatus Forget(const std::string& name);
  // The following require the mutex.
  void NoteCommitted();
  void WriteMark();

  const std::string directory_;
  std::function<rocksdb::IOStatus()> locked_;
  // The locked directory; -1: none.
  int directory_lock_ = -1;
  std::atomic<uint64_t> failed_syncs_ = 0;
  // True if CURRENT was renamed and the directory not synced since.
  std::atomic<bool> is_current_new_ = false;

  mutable std::mutex mutex_;
  // Guarded by the mutex.
  std::map<std::string, LogState> logs_;
  LogMark mark_;
  // The newest manifest, which CURRENT may not name yet, and its synced bytes.
  uint64_t newest_manifest_ = 0;
  LogMark::Synced newest_manifest_synced_;
  // Null: no mark is kept.
  std::shared_ptr<rocksdb::FSRandomRWFile> mark_file_;
  bool mark_changed_ = false;
  bool mark_fails_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_FILES_LOG_FILE_SYSTEM_H_
