#ifndef HULLD_CLIENT_FORMATS_OFF_READER_H_
#define HULLD_CLIENT_FORMATS_OFF_READER_H_

#include <absl/status/status.h>

#include <cstdint>
#include <string_view>

#include "client/formats/byte_source.h"

namespace hulld {

// Walks an OFF file line by line: keyword, counts, vertices, faces. It knows
// the variants that start each vertex line with the position: OFF, COFF, NOFF, STOFF and their
// combinations.
class OffReader {
 public:
  explicit OffReader(ByteSource* source) : source_(source) {}

  absl::Status ReadHeader();
  uint64_t vertex_count() const { return vertex_count_; }
  uint64_t face_count() const { return face_count_; }

  // The line of the next vertex, the `index`-th.
  absl::Status NextVertex(uint64_t index, std::string_view* content);
  // The same for faces, which come after all vertices.
  absl::Status NextFace(uint64_t index, std::string_view* content);

  // The next line with something on it, comments cut off. False at the end.
  bool NextContent(std::string_view* content);

 private:
  ByteSource* source_;
  uint64_t vertex_count_ = 0;
  uint64_t face_count_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_OFF_READER_H_
