#ifndef HULLD_SERVER_STORE_DATA_DIRECTORY_H_
#define HULLD_SERVER_STORE_DATA_DIRECTORY_H_

#include <string>

// Where things are in --data-dir.
namespace hulld::server {

inline std::string DatabaseDirectory(const std::string& data_dir) { return data_dir + "/rocksdb"; }

// Ours alone, and nothing in it outlives the server: what else lies in the data directory is not
// ours to touch.
inline std::string ScratchDirectory(const std::string& data_dir) {
  return data_dir + "/hulld-scratch";
}

// 'hullctl backup restore' leaves this file in the directory that it makes.
inline std::string RestoredMark(const std::string& data_dir) { return data_dir + "/restored"; }

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_DATA_DIRECTORY_H_
