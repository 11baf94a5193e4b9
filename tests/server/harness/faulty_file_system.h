#ifndef HULLD_TESTS_SERVER_HARNESS_FAULTY_FILE_SYSTEM_H_
#define HULLD_TESTS_SERVER_HARNESS_FAULTY_FILE_SYSTEM_H_

#include <rocksdb/env.h>
#include <rocksdb/file_system.h>

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <shared_mutex>
#include <string>
#include <vector>

namespace hulld::server {

// A wrapper of the real file system that injects faults and tracks the data that would survive a
// power failure: the synced bytes of each file, and the entries of each directory as of its last
// sync. Deletions take effect immediately.
class FaultyFileSystem : public rocksdb::FileSystemWrapper {
 public:
  enum class Fault {
    kNone,
    // The disk is full: writes are cut short.
    kNoSpace,
    // Writes, syncs, and directory changes fail.
    kIoError,
    // Like kIoError, but with the error of a read-only file system.
    kReadOnly,
    // Writes succeed, syncs fail.
    kSyncError,
    // Like kSyncError, but for file systems that allocate space only at sync.
    kNoSpaceAtSync,
    // Reads of table files (.sst) fail; everything else succeeds.
    kReadError,
  };

  FaultyFileSystem() : FileSystemWrapper(rocksdb::FileSystem::Default()) {}
  const char* Name() const override { return "FaultyFileSystem"; }

  // failures: the fault clears after this many.
  void SetFault(Fault fault, int64_t failures = std::numeric_limits<int64_t>::max());
  // Limits the space for all files written through this file system. Writes that do not fit are cut
  // short. Space that RocksDB preallocates for its own files does not count.
  void SetRoom(uint64_t bytes);
  // Space used by files that count toward SetRoom.
  uint64_t used() const;
  // File syncs so far, except those of files overwritten in place.
  int64_t syncs() const;

  // Directories created so far, and the subset with entries that a power failure would lose.
  std::vector<std::string> directories() const;
  std::vector<std::string> unsynced_directories() const;

  // Makes `target` the state of `source` after a power failure at this instant. A random prefix of
  // the unsynced bytes survives as well. Paths have no trailing slash. Concurrent writes are seen
  // completely or not at all.
  void CopySurvivors(const std::string& source, const std::string& target, std::mt19937_64& random);

  rocksdb::IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewRandomAccessFile(const std::string& name,
                                        const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* result,
                                        rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewRandomRWFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSRandomRWFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewDirectory(const std::string& name, const rocksdb::IOOptions& options,
                                 std::unique_ptr<rocksdb::FSDirectory>* result,
                                 rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus CreateDir(const std::string& name, const rocksdb::IOOptions& options,
                              rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus CreateDirIfMissing(const std::string& name, const rocksdb::IOOptions& options,
                                       rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus RenameFile(const std::string& source, const std::string& target,
                               const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus DeleteFile(const std::string& name, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;

 private:
  class File;
  class Overwritten;
  class Table;
  class Directory;

  struct Written {
    uint64_t size = 0;
    uint64_t synced = 0;
    bool entry_synced = false;
    // Preallocated beyond `size`.
    uint64_t reserved = 0;
    // Unsynced in-place overwrites: the previous bytes by offset.
    std::map<uint64_t, std::string> overwritten;
    // Contents under this name at the directory's last sync.
    std::optional<std::string> former;
  };

  // Returns the current error of an operation and counts the failure. Requires: state_mutex_ (not
  // annotated: std::mutex has no capability attributes).
  rocksdb::IOStatus Error(bool is_sync);
  rocksdb::IOStatus InjectedError(bool is_sync) const;
  // Returns how many of `size` more bytes fit. Requires: state_mutex_.
  uint64_t Fitting(uint64_t size) const;

  // Held shared by writes, exclusively while survivors are copied.
  mutable std::shared_mutex mutex_;
  mutable std::mutex state_mutex_;
  // Guarded by state_mutex_.
  Fault fault_ = Fault::kNone;
  int64_t failures_left_ = 0;
  int64_t syncs_ = 0;
  uint64_t room_ = std::numeric_limits<uint64_t>::max();
  std::map<std::string, Written> files_;
  // By directory created: true if its entry is synced.
  std::map<std::string, bool> directories_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_FAULTY_FILE_SYSTEM_H_
