#ifndef HULLD_CLIENT_FORMATS_OBJ_FACE_H_
#define HULLD_CLIENT_FORMATS_OBJ_FACE_H_

#include <absl/status/status.h>

#include <cstdint>
#include <string_view>

#include "client/formats/byte_source.h"

namespace hulld {

// The vertex that a corner of an OBJ face names: 7 for "7", "7/1", "7//3" and "7/1/3". Counted from
// 1; a negative number counts back from the last vertex before the face. False when it is none of
// these, or 0.
bool ParseObjCorner(std::string_view token, int64_t* vertex);

// Checks the faces of an OBJ file for a reader that wants its points alone: a face that names a
// vertex that does not exist shows that the file is broken.
class ObjFaceCheck {
 public:
  // `corners`: what follows `f` on the source's present line. vertices: how many came before.
  absl::Status Add(const ByteSource& source, std::string_view corners, uint64_t vertices);

  // At the end of the file: a face may come before its vertices.
  absl::Status Finish(const ByteSource& source, uint64_t vertices) const;

 private:
  // The largest vertex named, and the line that does so.
  uint64_t largest_ = 0;
  uint64_t largest_line_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_OBJ_FACE_H_
