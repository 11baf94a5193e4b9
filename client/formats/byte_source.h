#ifndef HULLD_CLIENT_FORMATS_BYTE_SOURCE_H_
#define HULLD_CLIENT_FORMATS_BYTE_SOURCE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hulld {

// A file or pipe that is read once from front to back, as lines or as bytes, through one buffer.
// Its memory does not grow with the file. It knows its position, for errors.
//
// Lines end at LF or CR LF, or at CR when the first line does. A UTF-8 byte order mark is skipped.
class ByteSource {
 public:
  static constexpr size_t kMaxLineBytes = size_t{16} << 20;

  // "-" is standard input. NOT_FOUND, PERMISSION_DENIED or INVALID_ARGUMENT, naming the file.
  static absl::StatusOr<std::unique_ptr<ByteSource>> Open(const std::string& path);

  // Takes the file descriptor over.
  ByteSource(int descriptor, std::string name);
  ~ByteSource();
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  // The next line without its end, valid until the next call. False at the end and on an error: see
  // status().
  bool ReadLine(std::string_view* line);
  // Exactly `size` bytes; false when there are fewer.
  bool Read(void* out, size_t size);
  bool Skip(uint64_t size);

  // Why reading stopped; OK at the end of the file.
  const absl::Status& status() const { return status_; }

  const std::string& name() const { return name_; }
  // The number of the line last read, from 1.
  uint64_t line() const { return line_; }
  // The position of the next byte, from 0.
  uint64_t offset() const { return base_ + begin_; }
  // Calls `progress` with the bytes taken from the file so far, whenever the buffer is filled.
  void ReportProgress(std::function<void(uint64_t bytes)> progress) {
    progress_ = std::move(progress);
  }

  // INVALID_ARGUMENT "NAME:LINE: message" and "NAME: byte OFFSET: message".
  absl::Status ErrorAtLine(const std::string& message) const;
  absl::Status ErrorAtByte(const std::string& message) const;
  // The error that stopped reading; if there is none, one that says that the file ends too early.
  absl::Status Truncated(const std::string& what) const;

 private:
  enum class LineEnd { kUnknown, kLf, kCr };

  // Moves what is left to the front of the buffer and reads more behind it. False at the end.
  bool Refill();
  // The length of the line that starts at begin_, searched from `from` on. False when the buffer
  // does not hold its end.
  bool FindLineEnd(size_t from, size_t* length);
  void SkipByteOrderMark();

  int descriptor_;
  std::string name_;
  std::vector<char> buffer_;
  // Unread bytes are buffer_[begin_, end_); buffer_[0] is byte base_ of the file.
  size_t begin_ = 0;
  size_t end_ = 0;
  uint64_t base_ = 0;
  uint64_t line_ = 0;
  bool at_start_ = true;
  bool at_end_ = false;
  LineEnd line_end_ = LineEnd::kUnknown;
  absl::Status status_;
  std::function<void(uint64_t)> progress_;
};

// All of a text, each line followed by LF. Errors are those of ByteSource.
absl::StatusOr<std::string> ReadText(const std::string& path);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_BYTE_SOURCE_H_
