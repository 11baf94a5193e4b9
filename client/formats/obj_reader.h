#ifndef HULLD_CLIENT_FORMATS_OBJ_READER_H_
#define HULLD_CLIENT_FORMATS_OBJ_READER_H_

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "client/formats/byte_source.h"

namespace hulld {

// Receives the statements of an OBJ file in order. Functions that are empty are not called.
struct ObjReceiver {
  // The text after `v`: three coordinates, then weight or color.
  std::function<absl::Status(std::string_view text)> vertex;
  // The vertices of a face, counted from 0. They may be defined later in the file.
  std::function<void(const std::vector<uint32_t>& corners)> face;
  // `o` or `g`, and the name after it.
  std::function<void(std::string_view keyword, std::string_view name)> name;
};

// Reads an OBJ file; the only reader of the format. A backslash continues a line, except in
// comments; a face may precede its vertices; negative numbers count back from the last vertex
// before the face. INVALID_ARGUMENT names the line, also if the file has no vertex, or a face names
// a missing one.
absl::Status WalkObj(ByteSource* source, const ObjReceiver& receiver);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_OBJ_READER_H_
