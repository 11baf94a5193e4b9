#ifndef HULLD_CLIENT_FORMATS_BYTE_SOURCE_H_
#define HULLD_CLIENT_FORMATS_BYTE_SOURCE_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hulld {

// Reads a file or pipe sequentially, as lines or bytes, through a single buffer. Memory does not
// grow with the file. Tracks its position for errors.
//
// Lines end at LF, CR LF, or CR, also within one file. If all lines so far end at CR, an LF ends a
// line of its own, because it may start binary data. A UTF-8 byte order mark is skipped, as is ^Z
// at the end of the file. Other lines with a NUL byte or ^Z are errors.
class ByteSource {
 public:
  static constexpr size_t kMaxLineBytes = size_t{16} << 20;

  // Opens a file; "-" is standard input. NOT_FOUND, PERMISSION_DENIED, or INVALID_ARGUMENT, naming
  // the file.
  static absl::StatusOr<std::unique_ptr<ByteSource>> Open(const std::string& path);

  // Takes ownership of the file descriptor.
  ByteSource(int descriptor, std::string name);
  ~ByteSource();
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  // Reads the next line without its end; valid until the next call. Returns false at the end and on
  // an error: see status().
  bool ReadLine(std::string_view* line);
  // Reads exactly `size` bytes; returns false if fewer are left.
  bool Read(void* out, size_t size);
  bool Skip(uint64_t size);
  // Reads the rest of the file, or as much as possible before an error; see status().
  std::string ReadRest();
  // Returns the next `size` bytes without consuming them; fewer at the end of the file. Valid until
  // the next call.
  std::string_view Peek(size_t size);

  // Returns an error if the first bytes show that the file is compressed or UTF-16 text, which
  // binary readers would misread. Consumes nothing.
  absl::Status CheckStart();

  // Reads up to the end of the file, or up to `limit` bytes. INVALID_ARGUMENT: these bytes could
  // contain a further record, because their number is at least `record_bytes` and not all are zero;
  // other bytes are padding. declared: the records before them, for the error, as in "2 points".
  absl::Status CheckEnd(const std::string& declared, uint64_t record_bytes,
                        uint64_t limit = std::numeric_limits<uint64_t>::max());

  // Returns the error that stopped reading; OK at the end of the file.
  const absl::Status& status() const { return status_; }

  const std::string& name() const { return name_; }
  // Number of the last line read, from 1.
  uint64_t line() const { return line_; }
  // Position of the next byte, from 0.
  uint64_t offset() const { return base_ + begin_; }
  // Calls `progress` with the bytes read so far whenever the buffer is filled.
  void ReportProgress(std::function<void(uint64_t bytes)> progress) {
    progress_ = std::move(progress);
  }

  // INVALID_ARGUMENT "NAME:LINE: message" and "NAME: byte OFFSET: message".
  absl::Status ErrorAtLine(const std::string& message) const;
  absl::Status ErrorAtByte(const std::string& message) const;
  // Returns the error that stopped reading, or else the error that the file is truncated.
  absl::Status Truncated(const std::string& what) const;

 private:
  // Moves the unread bytes to the front of the buffer and fills the rest. Returns false at the end.
  bool Refill();
  // Finds the length of the line at begin_, without and with its end, searching from `from`.
  // Returns false if its end is not in the buffer.
  bool FindLineEnd(size_t from, size_t* length, size_t* end);
  void SkipByteOrderMark();
  absl::Status Utf16Error() const;

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
  // True if the last line ended at CR; if no line ended otherwise.
  bool after_cr_ = false;
  bool only_cr_ = true;
  absl::Status status_;
  std::function<void(uint64_t)> progress_;
};

// Returns the name of a file in messages; "-" is standard input.
std::string SourceName(const std::string& path);

// Reads a whole text; each line is followed by LF. Errors are those of ByteSource.
absl::StatusOr<std::string> ReadText(const std::string& path);

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_BYTE_SOURCE_H_
