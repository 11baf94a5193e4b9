#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <charconv>
#include <limits>
#include <string>

#include "client/formats/mesh_readers.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

class ObjWalk {
 public:
  ObjWalk(ByteSource* source, const ObjReceiver& receiver) : source_(source), receiver_(receiver) {}

  absl::Status Run() {
    std::string continued;
    for (std::string_view line; source_->ReadLine(&line);) {
      const std::string_view content = Trim(line);
      if (content.ends_with('\\') && WithoutComment(content) == content &&
          MayContinue(continued.empty() ? content : continued)) {
        continued.append(content.substr(0, content.size() - 1)).push_back(' ');
        if (continued.size() <= ByteSource::kMaxLineBytes) continue;
        return source_->ErrorAtLine("the continued line is longer than 16 MiB");
      }
      absl::Status status = TakeStatement(continued.empty() ? content : continued.append(content));
      if (!status.ok()) return status;
      continued.clear();
    }
    if (!source_->status().ok()) return source_->status();
    if (!continued.empty()) return source_->Truncated("after a backslash that continues its line");
    return Finish();
  }

 private:
  // Returns true if a backslash continues the statement. Names and comments often contain Windows
  // paths, which may end in a backslash; the next line is then a statement of its own.
  static bool MayContinue(std::string_view statement) {
    std::string_view keyword = NextToken(&statement);
    keyword = keyword.substr(0, keyword.find('\\'));
    return keyword == "v" || keyword == "f";
  }

  absl::Status TakeStatement(std::string_view rest) {
    const std::string_view keyword = NextToken(&rest);
    if (keyword == "v") {
      ++vertices_;
      return receiver_.vertex(WithoutComment(rest));
    }
    if (keyword == "f") return TakeFace(WithoutComment(rest));
    if ((keyword == "o" || keyword == "g") && receiver_.name) receiver_.name(keyword, Trim(rest));
    if (keyword == "call" || keyword == "csh") {
      return source_->ErrorAtLine(
          absl::StrCat("the file refers to ", Quoted(Trim(rest)),
                       ", which is not read; insert the content of that file here, and remove \"",
                       std::string(keyword), "\""));
    }
    // Names of statements have letters only.
    const bool is_vertex_or_face = keyword.starts_with('v') || keyword.starts_with('f');
    if (is_vertex_or_face && keyword.size() > 1 &&
        !absl::ascii_isalpha(static_cast<unsigned char>(keyword[1]))) {
      return source_->ErrorAtLine(absl::StrCat(Quoted(keyword), " is not a statement; separate \"",
                                               std::string(1, keyword[0]),
                                               "\" from its first number with a space"));
    }
    return absl::OkStatus();
  }

  // Corners are "7", "7/1", "7//3" or "7/1/3".
  absl::Status TakeFace(std::string_view rest) {
    corners_.clear();
    for (std::string_view token; !(token = NextToken(&rest)).empty();) {
      const std::string_view text = token.substr(0, token.find('/'));
      const char* const end = text.data() + text.size();
      int64_t vertex = 0;
      const auto [stop, error] = std::from_chars(text.data(), end, vertex);
      if (error == std::errc() && stop == end && vertex < 0) vertex += vertices_ + 1;
      if (error != std::errc() || stop != end || vertex <= 0 ||
          vertex > std::numeric_limits<uint32_t>::max()) {
        return source_->ErrorAtLine(
            absl::StrCat(Quoted(token), " is not a vertex; ", vertices_, " precede this line"));
      }
      if (vertex > largest_) {
        largest_ = vertex;
        largest_line_ = source_->line();
      }
      corners_.push_back(static_cast<uint32_t>(vertex - 1));
    }
    if (corners_.empty()) return source_->ErrorAtLine("a face names no vertex");
    if (receiver_.face) receiver_.face(corners_);
    return absl::OkStatus();
  }

  absl::Status Finish() const {
    if (vertices_ == 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          source_->name(), ": contains no vertices: no line starts with v; is it an OBJ file?"));
    }
    if (largest_ <= vertices_) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(source_->name(), ":", largest_line_,
                                                   ": a face names vertex ", largest_,
                                                   ", but the file has ", vertices_));
  }

  ByteSource* source_;
  const ObjReceiver& receiver_;
  std::vector<uint32_t> corners_;
  int64_t vertices_ = 0;
  // The largest vertex number in a face, from 1, and its line.
  int64_t largest_ = 0;
  uint64_t largest_line_ = 0;
};

}  // namespace

absl::Status WalkObj(ByteSource* source, const ObjReceiver& receiver) {
  return ObjWalk(source, receiver).Run();
}

absl::Status ReadObj(ByteSource* source, PointCollector* points) {
  ObjReceiver receiver;
  receiver.vertex = [&](std::string_view text) { return AddTextPoint(*source, text, points); };
  return WalkObj(source, receiver);
}

}  // namespace hulld
