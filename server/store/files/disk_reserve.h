#ifndef HULLD_SERVER_STORE_FILES_DISK_RESERVE_H_
#define HULLD_SERVER_STORE_FILES_DISK_RESERVE_H_

#include <rocksdb/file_system.h>

#include <cstdint>
#include <string>
#include <utility>

namespace hulld::server {

// A file that reserves disk space, to be released when the disk is full. Not thread-safe.
class DiskReserve {
 public:
  // files must outlive this.
  DiskReserve(rocksdb::FileSystem& files, std::string path, uint64_t bytes)
      : files_(files), path_(std::move(path)), bytes_(bytes) {}

  // Creates the file if it is missing. On error, no file exists. Cost: one allocation of the file
  // system, or writing `bytes` if it does not support allocation.
  rocksdb::IOStatus Ensure();
  // Deletes the file. Returns true if it existed.
  bool Release();
  // True from a successful Ensure until Release.
  bool is_made() const { return is_made_; }

 private:
  rocksdb::FileSystem& files_;
  const std::string path_;
  const uint64_t bytes_;
  bool is_made_ = false;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_FILES_DISK_RESERVE_H_
