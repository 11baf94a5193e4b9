#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "client/formats/mesh_readers.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

constexpr size_t kStlHeaderBytes = 80;
constexpr size_t kTriangleBytes = 50;
// A prefix that contains the count and 18 triangles of a binary file. One of its bytes is a control
// character: the high byte of the count if no other, as long as the file has fewer than 2^24
// triangles.
constexpr size_t kBytesToClassify = 1024;

// Text is a sequence of words: lines matter only after `solid` and `endsolid`, where the name is
// the rest of the line.
class StlText {
 public:
  StlText(ByteSource* source, const StlReceiver& receiver) : source_(source), receiver_(receiver) {}

  absl::Status Run() {
    while (NextWord()) {
      if (!Is("solid")) return Unexpected("solid");
      receiver_.solid(Trim(rest_));
      rest_ = {};
      if (absl::Status status = ReadSolid(); !status.ok()) return status;
    }
    if (!source_->status().ok()) return source_->status();
    return facets_ > 0 ? absl::OkStatus() : source_->ErrorAtLine("the file contains no facet");
  }

 private:
  bool NextWord() {
    while ((word_ = NextToken(&rest_)).empty()) {
      if (!source_->ReadLine(&rest_)) return false;
    }
    return true;
  }

  bool Is(std::string_view keyword) const {
    return absl::EqualsIgnoreCase(absl::string_view(word_.data(), word_.size()),
                                  absl::string_view(keyword.data(), keyword.size()));
  }

  absl::Status Ended(std::string_view missing) const {
    if (!source_->status().ok()) return source_->status();
    return source_->ErrorAtLine(absl::StrCat("the file ends after ", Counted(facets_, "facet"),
                                             ", before ", std::string(missing),
                                             "; is it complete?"));
  }

  absl::Status Unexpected(std::string_view expected) const {
    return source_->ErrorAtLine(absl::StrCat(Quoted(word_), " after ", Counted(facets_, "facet"),
                                             " where \"", std::string(expected), "\" is expected"));
  }

  absl::Status Expect(std::string_view keyword) {
    if (!NextWord()) return Ended(keyword);
    return Is(keyword) ? absl::OkStatus() : Unexpected(keyword);
  }

  absl::Status ReadSolid() {
    for (;; ++facets_) {
      if (!NextWord()) return Ended("endsolid");
      if (Is("endsolid")) break;
      if (!Is("facet")) return Unexpected("facet");
      if (absl::Status status = ReadFacet(); !status.ok()) return status;
    }
    rest_ = {};
    return absl::OkStatus();
  }

  absl::Status ReadFacet() {
    // Skips `normal` and three words, which may be missing.
    for (int words = 0;; ++words) {
      if (!NextWord()) return Ended("outer");
      if (Is("outer")) break;
      if (words == 4) return Unexpected("outer");
    }
    absl::Status status = Expect("loop");
    for (int i = 0; i < 3 && status.ok(); ++i) status = ReadCorner();
    if (status.ok()) status = Expect("endloop");
    return status.ok() ? Expect("endfacet") : status;
  }

  absl::Status ReadCorner() {
    if (absl::Status status = Expect("vertex"); !status.ok()) return status;
    std::array<double, 3> p;
    for (size_t axis = 0; axis < 3; ++axis) {
      if (!NextWord()) return Ended("the end of a vertex");
      const NumberText kind = receiver_.parse(word_, axis, &p[axis]);
      if (kind != NumberText::kNumber) return source_->ErrorAtLine(NumberProblem(kind, word_));
    }
    return receiver_.corner(
        p, [this](const std::string& message) { return source_->ErrorAtLine(message); });
  }

  ByteSource* source_;
  const StlReceiver& receiver_;
  std::string_view rest_;
  std::string_view word_;
  uint64_t facets_ = 0;
};

absl::Status ReadTriangle(const char* bytes, const StlReceiver& receiver,
                          const StlErrorAt& error_at) {
  for (size_t corner = 1; corner <= 3; ++corner) {
    std::array<float, 3> p;
    std::memcpy(p.data(), bytes + corner * sizeof(p), sizeof(p));
    if (absl::Status status = receiver.float_corner(p, error_at); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status WalkBinaryStl(ByteSource* source, const StlReceiver& receiver) {
  uint32_t count = 0;
  if (!source->Skip(kStlHeaderBytes) || !source->Read(&count, sizeof(count))) {
    return source->Truncated("within the 84 bytes before the triangles of a binary STL");
  }
  receiver.solid("");
  uint64_t at = source->offset();
  const StlErrorAt error_at = [&](const std::string& message) {
    return absl::InvalidArgumentError(absl::StrCat(source->name(), ": byte ", at, ": ", message));
  };
  char triangle[kTriangleBytes];
  for (uint32_t i = 0; i < count; ++i) {
    at = source->offset();
    if (!source->Read(triangle, sizeof(triangle))) {
      return source->Truncated(absl::StrCat("after ", i, " of ", count, " triangles"));
    }
    absl::Status status = ReadTriangle(triangle, receiver, error_at);
    if (!status.ok()) return status;
  }
  at = source->offset();
  (void)source->Skip(std::numeric_limits<uint64_t>::max());
  if (!source->status().ok()) return source->status();
  const uint64_t extra = source->offset() - at;
  if (count == 0 && extra == 0) return error_at("the file contains no triangle");
  if (count == 0 || (extra > 0 && extra % kTriangleBytes == 0)) {
    return error_at(absl::StrCat("the header declares ", Counted(count, "triangle"), " and ",
                                 Counted(extra, "byte"),
                                 " follow them; correct the count at byte 80, or cut the file "
                                 "at the last triangle"));
  }
  return absl::OkStatus();
}

bool IsControl(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 && !absl::ascii_isspace(byte);
}

// True if a file that contains control characters is text that was damaged, not binary: its header
// would be unusual, and the count of triangles would be at least 2^27, as its high byte is text.
bool IsDamagedText(std::string_view start) {
  constexpr size_t kHighByteOfCount = kStlHeaderBytes + 3;
  const std::string text = absl::AsciiStrToLower(std::string(start));
  return absl::StartsWith(text, "solid") && absl::StrContains(text, "facet normal") &&
         !(start.size() > kHighByteOfCount && IsControl(start[kHighByteOfCount]));
}

}  // namespace

absl::Status WalkStl(ByteSource* source, const StlReceiver& receiver) {
  std::string_view start = source->Peek(kBytesToClassify);
  if (!source->status().ok()) return source->status();
  // The end-of-text mark of DOS.
  if (start.size() < kBytesToClassify && !start.empty() && start.back() == '\x1A')
    start.remove_suffix(1);
  if (std::any_of(start.begin(), start.end(), IsControl) && !IsDamagedText(start)) {
    return WalkBinaryStl(source, receiver);
  }
  if (start.empty())
    return absl::InvalidArgumentError(source->name() + ": not an STL file: it is empty");
  if (start.substr(0, 3) == "\xEF\xBB\xBF") start.remove_prefix(3);
  const std::string_view word = NextToken(&start);
  if (absl::EqualsIgnoreCase(absl::string_view(word.data(), word.size()), "solid")) {
    return StlText(source, receiver).Run();
  }
  return absl::InvalidArgumentError(
      absl::StrCat(source->name(), ": not an STL file: it starts with ", Quoted(word),
                   " where \"solid\" or the ", "header of a binary file is expected"));
}

absl::Status ReadStl(ByteSource* source, PointCollector* points) {
  StlReceiver receiver;
  receiver.solid = [](std::string_view) {};
  receiver.parse = [points](std::string_view text, size_t axis, double* value) {
    return points->Parse(text, axis, value);
  };
  receiver.corner = [points](const auto& p, const StlErrorAt& error_at) {
    return points->AddScaled(p[0], p[1], p[2], error_at);
  };
  receiver.float_corner = [points](const auto& p, const StlErrorAt& error_at) {
    return points->AddFloat(p[0], p[1], p[2], error_at);
  };
  return WalkStl(source, receiver);
}

}  // namespace hulld
