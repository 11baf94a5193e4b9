#ifndef HULLD_TESTS_CLIENT_FORMATS_POINT_READING_H_
#define HULLD_TESTS_CLIENT_FORMATS_POINT_READING_H_

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "client/formats/point_file.h"

namespace hulld {

// A temporary file, deleted with the object.
class TempFile {
 public:
  TempFile(const std::string& name, const std::string& content) {
    static std::atomic<int> next{0};
    path_ = testing::TempDir() + "hulld_client_" + std::to_string(getpid()) + "_" +
            std::to_string(next++) + "_" + name;
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~TempFile() { std::remove(path_.c_str()); }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct PointsRead {
  absl::Status status;
  ReadCounts counts;
  std::vector<PointChunk> blocks;

  // All coordinates in order, floats widened.
  std::vector<double> xyz() const {
    std::vector<double> all;
    for (const PointChunk& block : blocks) {
      all.insert(all.end(), block.xyz.begin(), block.xyz.end());
      all.insert(all.end(), block.xyz_float.begin(), block.xyz_float.end());
    }
    return all;
  }
  bool all_float() const {
    for (const PointChunk& block : blocks) {
      if (!block.xyz.empty()) return false;
    }
    return !blocks.empty();
  }
  std::string error() const {
    return std::string(status.message().data(), status.message().size());
  }
};

inline PointsRead ReadFile(const std::string& path, PointFormat format, ReadOptions options = {}) {
  PointsRead result;
  const auto counts = ReadPoints(ReadRequest{path, format, options, {}}, [&](PointChunk block) {
    result.blocks.push_back(std::move(block));
    return absl::OkStatus();
  });
  result.status = counts.status();
  if (counts.ok()) result.counts = *counts;
  return result;
}

inline PointsRead ReadText(const std::string& content, PointFormat format,
                           ReadOptions options = {}) {
  const TempFile file("points", content);
  PointsRead result = ReadFile(file.path(), format, options);
  // Errors name the file; tests compare the rest.
  std::string error = result.error();
  if (const size_t at = error.find(file.path()); at != std::string::npos) {
    error.replace(at, file.path().size(), "FILE");
    result.status = absl::Status(result.status.code(), error);
  }
  return result;
}

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_FORMATS_POINT_READING_H_
