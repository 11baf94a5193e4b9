#ifndef HULLD_CLIENT_FORMATS_OFF_READER_H_
#define HULLD_CLIENT_FORMATS_OFF_READER_H_

#include <absl/status/status.h>

#include <cstdint>
#include <string_view>
#include <vector>

#include "client/formats/byte_source.h"

namespace hulld {

// Reads an OFF file line by line: keyword, counts, vertices, faces. Supports the variants with the
// position first in each vertex line: OFF, COFF, NOFF, STOFF, and their combinations.
class OffReader {
 public:
  explicit OffReader(ByteSource* source) : source_(source) {}

  absl::Status ReadHeader();
  uint64_t vertex_count() const { return vertex_count_; }
  uint64_t face_count() const { return face_count_; }

  // Reads the line of the next vertex, the `index`-th.
  absl::Status NextVertex(uint64_t index, std::string_view* content);
  // Reads the next face, the `index`-th. Faces follow all vertices.
  absl::Status NextFace(uint64_t index, std::vector<uint32_t>* corners);
  // Requires that all faces were read. INVALID_ARGUMENT if more follows: a wrong count makes
  // readers mistake vertices for faces.
  absl::Status Finish();

  // Reads the next line that is not blank, without comments. Returns false at the end.
  bool NextContent(std::string_view* content);

 private:
  ByteSource* source_;
  uint64_t vertex_count_ = 0;
  uint64_t face_count_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_OFF_READER_H_
