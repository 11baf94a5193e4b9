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

// A file system in front of the real one that can fail, and that knows what a disk would hold if
// the power went out now: the bytes of each file that were synced, and the entries of each
// directory that were there when it was synced last. Deletions count at once.
class FaultyFileSystem : public rocksdb::FileSystemWrapper {
 public:
  enum class Fault {
    kNone,
    // Writes fail half done: the disk is full.
    kNoSpace,
    // Writes, syncs and changes of directories fail.
    kIoError,
    // As kIoError, with the error of a file system that is mounted for reading.
    kReadOnly,
    // Writes work, syncs fail.
    kSyncError,
    // The same, as where a file system finds room for what was written only when it is synced.
    kNoSpaceAtSync,
    // Reading tables fails, which are the files that end in .sst; the rest works.
    kReadError,
  };

  FaultyFileSystem() : FileSystemWrapper(rocksdb::FileSystem::Default()) {}
  const char* Name() const override { return "FaultyFileSystem"; }

  // failures: after this many, the fault is over.
  void SetFault(Fault fault, int64_t failures = std::numeric_limits<int64_t>::max());
  // Syncs of files so far.
  int64_t syncs() const;

  // The directories that were made, and those of them whose entries could be lost.
  std::vector<std::string> directories() const;
  std::vector<std::string> unsynced_directories() const;

  // Makes `target` what would be left of `source` if the power went out at this very moment. A
  // random part, from the front, of the bytes that were not synced is left, too. Both names come
  // without a slash at the end. Nothing that is written meanwhile is seen in part.
  void CopySurvivors(const std::string& source, const std::string& target, std::mt19937_64& random);

  rocksdb::IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewRandomAccessFile(const std::string& name,
                                        const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* result,
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
  class Table;
  class Directory;

  struct Written {
    uint64_t size = 0;
    uint64_t synced = 0;
    bool entry_synced = false;
    // What was there under this name when its directory was synced last.
    std::optional<std::string> former;
  };

  // What an operation fails with now; counts that it does. Requires state_mutex_ (unchecked: a
  // std::mutex does not tell).
  rocksdb::IOStatus Error(bool is_sync);
  rocksdb::IOStatus WhatFails(bool is_sync) const;

  // Held shared while something is written, alone while survivors are copied.
  mutable std::shared_mutex mutex_;
  mutable std::mutex state_mutex_;
  // Guarded by state_mutex_.
  Fault fault_ = Fault::kNone;
  int64_t failures_left_ = 0;
  int64_t syncs_ = 0;
  std::map<std::string, Written> files_;
  // Whether the entry of each that was made is synced.
  std::map<std::string, bool> directories_;
};

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_FAULTY_FILE_SYSTEM_H_
