#ifndef HULLD_SERVER_STORE_DATA_DIRECTORY_H_
#define HULLD_SERVER_STORE_DATA_DIRECTORY_H_

#include <string>

// Paths in --data-dir.
namespace hulld::server {

inline std::string DatabaseDirectory(const std::string& data_dir) { return data_dir + "/rocksdb"; }

// A directory for temporary files, emptied at each start. Other files in the data directory are not
// touched.
inline std::string ScratchDirectory(const std::string& data_dir) {
  return data_dir + "/hulld-scratch";
}

// The high-water mark of the write-ahead logs (files/log_mark.h).
inline std::string LogMarkPath(const std::string& data_dir) { return data_dir + "/hulld-log-mark"; }

// The reserve for a full disk (files/disk_reserve.h).
inline std::string ReservePath(const std::string& data_dir) { return data_dir + "/hulld-reserve"; }

// A file that 'hullctl backup restore' leaves in its new directory.
inline std::string RestoredMark(const std::string& data_dir) { return data_dir + "/restored"; }

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_DATA_DIRECTORY_H_
