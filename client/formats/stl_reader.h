#ifndef HULLD_CLIENT_FORMATS_STL_READER_H_
#define HULLD_CLIENT_FORMATS_STL_READER_H_

#include <absl/status/status.h>

#include <array>
#include <functional>
#include <string_view>

#include "client/formats/byte_source.h"
#include "client/formats/text_number.h"

namespace hulld {

// Creates an error that names the location of a corner.
using StlErrorAt = std::function<absl::Status(const std::string& message)>;

// Receives the solids of an STL file in order, and three corners for each facet.
struct StlReceiver {
  // The name may be empty; binary files have one solid without a name.
  std::function<void(std::string_view name)> solid;
  // Parses a coordinate (axis: 0, 1, 2) of a text file.
  std::function<NumberText(std::string_view text, size_t axis, double* value)> parse;
  // Receives a corner of a text file.
  std::function<absl::Status(const std::array<double, 3>& p, const StlErrorAt& error_at)> corner;
  // Receives a corner of a binary file.
  std::function<absl::Status(const std::array<float, 3>& p, const StlErrorAt& error_at)>
      float_corner;
};

// Reads an STL file, text or binary. Text starts with `solid` and has no control characters in its
// first KiB; keywords may have any letter case, and normals are ignored and may be missing.
// INVALID_ARGUMENT, with the line or byte and the number of facets read: the file is truncated or
// has no facet, or a binary file has room for more whole triangles than it declares. Other bytes
// after the last triangle are ignored.
absl::Status WalkStl(ByteSource* source, const StlReceiver& receiver);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_STL_READER_H_
