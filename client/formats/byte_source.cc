#include "client/formats/byte_source.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace hulld {
namespace {

constexpr size_t kBufferBytes = size_t{256} << 10;

}  // namespace

std::string SourceName(const std::string& path) { return path == "-" ? "standard input" : path; }

absl::StatusOr<std::unique_ptr<ByteSource>> ByteSource::Open(const std::string& path) {
  if (path == "-") return std::make_unique<ByteSource>(dup(STDIN_FILENO), SourceName(path));
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    const std::string message = absl::StrCat("cannot open ", path, ": ", strerror(errno));
    if (errno == ENOENT) return absl::NotFoundError(message);
    if (errno == EACCES) return absl::PermissionDeniedError(message);
    return absl::InvalidArgumentError(message);
  }
  struct stat info;
  if (fstat(descriptor, &info) == 0 && S_ISDIR(info.st_mode)) {
    close(descriptor);
    return absl::InvalidArgumentError(absl::StrCat(path, " is a directory; pass a file"));
  }
  return std::make_unique<ByteSource>(descriptor, path);
}

ByteSource::ByteSource(int descriptor, std::string name)
    : descriptor_(descriptor), name_(std::move(name)), buffer_(kBufferBytes) {}

ByteSource::~ByteSource() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool ByteSource::Refill() {
  if (at_end_) return false;
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    base_ += begin_;
    end_ -= begin_;
    begin_ = 0;
  }
  if (end_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
  ssize_t count;
  do {
    count = read(descriptor_, buffer_.data() + end_, buffer_.size() - end_);
  } while (count < 0 && errno == EINTR);
  if (count <= 0) {
    at_end_ = true;
    if (count < 0) {
      status_ =
          absl::InvalidArgumentError(absl::StrCat("cannot read ", name_, ": ", strerror(errno)));
    }
    return false;
  }
  end_ += static_cast<size_t>(count);
  if (progress_) progress_(base_ + end_);
  return true;
}

void ByteSource::SkipByteOrderMark() {
  at_start_ = false;
  while (end_ - begin_ < 3 && Refill()) continue;
  const std::string_view start(buffer_.data() + begin_, end_ - begin_);
  if (start.substr(0, 3) == "\xEF\xBB\xBF") {
    begin_ += 3;
  } else if (start.substr(0, 2) == "\xFE\xFF" || start.substr(0, 2) == "\xFF\xFE") {
    status_ = Utf16Error();
  }
}

absl::Status ByteSource::Utf16Error() const {
  return absl::InvalidArgumentError(
      absl::StrCat(name_, " is UTF-16 text; convert it first: iconv -f UTF-16 -t UTF-8"));
}

absl::Status ByteSource::CheckStart() {
  constexpr std::pair<std::string_view, const char*> kCompressed[] = {
      {"\x1F\x8B", "gzip"},  {"PK\x03\x04", "zip"},        {"BZh", "bzip2"},
      {"\xFD\x37zXZ", "xz"}, {"\x28\xB5\x2F\xFD", "zstd"}, {"7z\xBC\xAF", "7-Zip"}};
  const std::string_view start = Peek(6);
  for (const auto& [magic, format] : kCompressed) {
    if (start.substr(0, magic.size()) != magic) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(name_, " is compressed (", format, "); decompress it first"));
  }
  const std::string_view mark = start.substr(0, 2);
  return mark == "\xFE\xFF" || mark == "\xFF\xFE" ? Utf16Error() : status_;
}

bool ByteSource::FindLineEnd(size_t from, size_t* length, size_t* end) {
  const std::string_view unread(buffer_.data() + begin_, end_ - begin_);
  // Searches for the kind of the last line end first: the other kind may be far away, or absent.
  const size_t found = unread.find(after_cr_ ? '\r' : '\n', from);
  const size_t at = std::min(found, unread.substr(0, found).find(after_cr_ ? '\n' : '\r', from));
  if (at == std::string_view::npos) return false;
  const bool may_pair = unread[at] == '\r' && !(only_cr_ && line_ > 0);
  // A CR at the end of the buffer may be the first half of a CR LF.
  if (may_pair && at + 1 == unread.size()) return false;
  const bool is_pair = may_pair && unread[at + 1] == '\n';
  after_cr_ = unread[at] == '\r' && !is_pair;
  only_cr_ = only_cr_ && after_cr_;
  *length = at;
  *end = at + (is_pair ? 2 : 1);
  return true;
}

bool ByteSource::ReadLine(std::string_view* line) {
  if (at_start_) SkipByteOrderMark();
  if (!status_.ok()) return false;
  size_t length = 0;
  size_t end = 0;
  size_t searched = 0;
  while (!FindLineEnd(searched, &length, &end)) {
    length = end = end_ - begin_;
    if (length > kMaxLineBytes) {
      ++line_;
      status_ = ErrorAtLine("the line is longer than 16 MiB; is this a text file?");
      return false;
    }
    searched = length > 0 ? length - 1 : 0;
    if (Refill()) continue;
    if (!status_.ok() || length == 0) return false;
    break;
  }
  ++line_;
  *line = std::string_view(buffer_.data() + begin_, length);
  begin_ += end;
  while (!line->empty() && line->back() == '\r') line->remove_suffix(1);
  // The end-of-text mark of DOS.
  if (at_end_ && begin_ == end_ && !line->empty() && line->back() == '\x1A') line->remove_suffix(1);
  for (const auto& [byte, name] : {std::pair('\0', "NUL"), std::pair('\x1A', "^Z")}) {
    if (line->find(byte) == std::string_view::npos) continue;
    status_ = ErrorAtLine(absl::StrCat("the line contains the byte ", static_cast<int>(byte), " (",
                                       name, "); is it an undamaged text file?"));
    return false;
  }
  return true;
}

bool ByteSource::Read(void* out, size_t size) {
  char* to = static_cast<char*>(out);
  for (;;) {
    const size_t count = std::min(size, end_ - begin_);
    std::memcpy(to, buffer_.data() + begin_, count);
    begin_ += count;
    to += count;
    size -= count;
    if (size == 0) return true;
    if (!Refill()) return false;
  }
}

bool ByteSource::Skip(uint64_t size) {
  for (;;) {
    const size_t count = static_cast<size_t>(std::min<uint64_t>(size, end_ - begin_));
    begin_ += count;
    size -= count;
    if (size == 0) return true;
    if (!Refill()) return false;
  }
}

std::string ByteSource::ReadRest() {
  std::string bytes;
  do {
    bytes.append(buffer_.data() + begin_, end_ - begin_);
    begin_ = end_;
  } while (Refill());
  return bytes;
}

std::string_view ByteSource::Peek(size_t size) {
  while (end_ - begin_ < size && Refill()) continue;
  return {buffer_.data() + begin_, std::min(size, end_ - begin_)};
}

absl::Status ByteSource::CheckEnd(const std::string& declared, uint64_t record_bytes,
                                  uint64_t limit) {
  const uint64_t begin = offset();
  bool is_padding = true;
  do {
    const uint64_t left = limit - (offset() - begin);
    const std::string_view bytes =
        Peek(static_cast<size_t>(std::min<uint64_t>(left, kBufferBytes)));
    is_padding = is_padding && bytes.find_first_not_of('\0') == std::string_view::npos;
    begin_ += bytes.size();
  } while (offset() - begin < limit && !at_end_);
  const uint64_t count = offset() - begin;
  if (is_padding || count < record_bytes) return status_;
  return absl::InvalidArgumentError(
      absl::StrCat(name_, ": byte ", begin, ": ", count, " bytes follow the ", declared,
                   " that the header declares; correct its count, or cut the file here"));
}

absl::Status ByteSource::ErrorAtLine(const std::string& message) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ":", line_, ": ", message));
}

absl::Status ByteSource::ErrorAtByte(const std::string& message) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ": byte ", offset(), ": ", message));
}

absl::Status ByteSource::Truncated(const std::string& what) const {
  if (!status_.ok()) return status_;
  return absl::InvalidArgumentError(
      absl::StrCat(name_, ": ends at byte ", offset(), " ", what, "; is it complete?"));
}

absl::StatusOr<std::string> ReadText(const std::string& path) {
  const auto source = ByteSource::Open(path);
  if (!source.ok()) return source.status();
  std::string text;
  std::string_view line;
  while ((*source)->ReadLine(&line)) text.append(line).append("\n");
  if (!(*source)->status().ok()) return (*source)->status();
  return text;
}

}  // namespace hulld
