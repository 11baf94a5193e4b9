#include <absl/strings/str_cat.h>

#include "client/formats/mesh_readers.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

bool IsPositionFirst(std::string_view keyword) {
  for (const std::string_view prefix : {"ST", "C", "N"}) {
    if (keyword.substr(0, prefix.size()) == prefix) keyword.remove_prefix(prefix.size());
  }
  return keyword == "OFF";
}

}  // namespace

bool OffReader::NextContent(std::string_view* content) {
  std::string_view line;
  while (source_->ReadLine(&line)) {
    *content = Trim(WithoutComment(line));
    if (!content->empty()) return true;
  }
  return false;
}

absl::Status OffReader::ReadHeader() {
  std::string_view rest;
  if (!NextContent(&rest)) return source_->Truncated("before the keyword OFF");
  std::string_view keyword = NextToken(&rest);
  // ModelNet files lack the white space in between: OFF8 12 0.
  if (const size_t digits = keyword.find_first_of("0123456789");
      digits != std::string_view::npos && IsPositionFirst(keyword.substr(0, digits))) {
    rest = {keyword.data() + digits, static_cast<size_t>(rest.end() - keyword.data()) - digits};
    keyword = keyword.substr(0, digits);
  }
  if (!IsPositionFirst(keyword)) {
    return source_->ErrorAtLine(absl::StrCat(
        Quoted(keyword), " is not OFF, COFF, NOFF or STOFF; other kinds are not supported"));
  }
  if (Trim(rest) == "BINARY") {
    return source_->ErrorAtLine("binary OFF is not supported; convert it to ascii OFF or to PLY");
  }
  // The counts may be on the line of the keyword.
  if (Trim(rest).empty() && !NextContent(&rest)) return source_->Truncated("before the counts");
  for (uint64_t* const count : {&vertex_count_, &face_count_}) {
    const std::string_view text = NextToken(&rest);
    if (ParseUnsigned(text, count)) continue;
    return source_->ErrorAtLine(
        absl::StrCat(Quoted(text), " is not a number of vertices or faces"));
  }
  return absl::OkStatus();
}

absl::Status OffReader::NextVertex(uint64_t index, std::string_view* content) {
  if (NextContent(content)) return absl::OkStatus();
  return source_->Truncated(absl::StrCat("after ", index, " of ", vertex_count_, " vertices"));
}

absl::Status OffReader::NextFace(uint64_t index, std::vector<uint32_t>* corners) {
  std::string_view content;
  if (!NextContent(&content)) {
    return source_->Truncated(absl::StrCat("after ", index, " of ", face_count_, " faces"));
  }
  uint64_t size = 0;
  bool ok = ParseUnsigned(NextToken(&content), &size);
  corners->clear();
  for (uint64_t corner = 0; ok && corner < size; ++corner) {
    uint64_t vertex = 0;
    ok = ParseUnsigned(NextToken(&content), &vertex) && vertex < vertex_count_;
    corners->push_back(static_cast<uint32_t>(vertex));
  }
  if (ok) return absl::OkStatus();
  return source_->ErrorAtLine(
      "a face needs its number of corners and that many vertices, as in 3 0 1 2");
}

absl::Status OffReader::Finish() {
  std::string_view content;
  if (!NextContent(&content)) return source_->status();
  return source_->ErrorAtLine(
      absl::StrCat("the file continues after ", Counted(vertex_count_, "vertex", "vertices"),
                   " and ", Counted(face_count_, "face"), ", the counts of its header"));
}

absl::Status ReadOff(ByteSource* source, PointCollector* points) {
  OffReader reader(source);
  if (absl::Status status = reader.ReadHeader(); !status.ok()) return status;
  if (reader.vertex_count() == 0 && reader.face_count() > 0) {
    return source->ErrorAtLine(
        absl::StrCat("the file declares ", reader.face_count(), " faces, but no vertex"));
  }
  std::string_view content;
  for (uint64_t i = 0; i < reader.vertex_count(); ++i) {
    absl::Status status = reader.NextVertex(i, &content);
    if (status.ok()) status = AddTextPoint(*source, content, points);
    if (!status.ok()) return status;
  }
  // The faces are not needed, but reading them detects truncation and wrong counts.
  std::vector<uint32_t> corners;
  for (uint64_t i = 0; i < reader.face_count(); ++i) {
    if (absl::Status status = reader.NextFace(i, &corners); !status.ok()) return status;
  }
  return reader.Finish();
}

}  // namespace hulld
