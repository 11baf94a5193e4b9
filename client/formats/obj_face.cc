#include "client/formats/obj_face.h"

#include <absl/strings/str_cat.h>

#include <charconv>

#include "client/formats/text_number.h"

namespace hulld {

bool ParseObjCorner(std::string_view token, int64_t* vertex) {
  token = token.substr(0, token.find('/'));
  const char* const end = token.data() + token.size();
  const auto [rest, error] = std::from_chars(token.data(), end, *vertex);
  return error == std::errc() && rest == end && *vertex != 0;
}

absl::Status ObjFaceCheck::Add(const ByteSource& source, std::string_view corners,
                               uint64_t vertices) {
  std::string_view token = NextToken(&corners);
  if (token.empty()) return source.ErrorAtLine("a face names no vertex");
  for (; !token.empty(); token = NextToken(&corners)) {
    int64_t vertex = 0;
    const bool known =
        ParseObjCorner(token, &vertex) && (vertex > 0 || vertex >= -static_cast<int64_t>(vertices));
    if (!known) {
      return source.ErrorAtLine(
          absl::StrCat(Quoted(token), " names no vertex; ", vertices, " came before"));
    }
    if (vertex > 0 && static_cast<uint64_t>(vertex) > largest_) {
      largest_ = static_cast<uint64_t>(vertex);
      largest_line_ = source.line();
    }
  }
  return absl::OkStatus();
}

absl::Status ObjFaceCheck::Finish(const ByteSource& source, uint64_t vertices) const {
  if (largest_ <= vertices) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(source.name(), ":", largest_line_,
                                                 ": a face names vertex ", largest_,
                                                 ", but the file holds ", vertices));
}

}  // namespace hulld
