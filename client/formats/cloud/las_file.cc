// LAS 1.0 to 1.4 (ASPRS, 2019), uncompressed: a binary header, then one record per point, which
// starts with three 32-bit integers. A coordinate is integer * scale + offset over the reals, with
// the doubles of the header, rounded once. Most readers also round the product, and may err by a
// unit in the last place of the larger summand.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "client/formats/binary_scalar.h"
#include "client/formats/point_file.h"
#include "client/formats/text_number.h"

namespace hulld {
namespace {

// Header sizes of LAS 1.0 to 1.2, of 1.3, and of 1.4, in bytes.
constexpr size_t kLasHeaderBytes = 227;
constexpr size_t kHeader13Bytes = 235;
constexpr size_t kHeader14Bytes = 375;
// Record sizes of point formats 0 to 10, in bytes; extra bytes may follow.
constexpr uint16_t kRecordBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

struct Header {
  uint64_t first_point = 0;
  uint64_t point_count = 0;
  // Start of the records after the points, which LAS 1.3 introduced.
  uint64_t next_records = std::numeric_limits<uint64_t>::max();
  uint64_t record_bytes = 0;
  std::array<double, 3> scale = {};
  std::array<double, 3> offset = {};
};

template <typename Scalar>
Scalar Load(const std::vector<unsigned char>& bytes, size_t at) {
  Scalar value;
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

// Reads the fields of LAS 1.3 and 1.4. They remain 0 in the header of an earlier version.
absl::Status ReadLaterFields(ByteSource* source, std::vector<unsigned char>* bytes) {
  const int minor = (*bytes)[25];
  const uint16_t size = Load<uint16_t>(*bytes, 94);
  if (minor == 4 && size < kHeader14Bytes) {
    return source->ErrorAtByte(
        absl::StrCat("a LAS 1.4 header has ", kHeader14Bytes, " bytes, not ", size));
  }
  if (minor < 3 || size < kHeader13Bytes) return absl::OkStatus();
  const size_t bytes_of_version = minor == 4 ? kHeader14Bytes : kHeader13Bytes;
  if (source->Read(bytes->data() + kLasHeaderBytes, bytes_of_version - kLasHeaderBytes)) {
    return absl::OkStatus();
  }
  return source->Truncated(absl::StrCat("within the header of LAS 1.", minor));
}

// Reads the number of points, and where they end. LAS 1.4 also has a 64-bit count; a field of 0 is
// not set.
absl::Status ReadPointCount(const ByteSource& source, const std::vector<unsigned char>& bytes,
                            Header* header) {
  const uint64_t legacy_count = Load<uint32_t>(bytes, 107);
  const uint64_t count = Load<uint64_t>(bytes, 247);
  if (legacy_count != 0 && count != 0 && legacy_count != count) {
    return source.ErrorAtByte(absl::StrCat("the header declares ", legacy_count,
                                           " points in its legacy field and ", count,
                                           " in its LAS 1.4 field; the file is damaged"));
  }
  header->point_count = std::max(legacy_count, count);
  const uint64_t waveforms = Load<uint64_t>(bytes, 227);
  const uint64_t extended_records = Load<uint32_t>(bytes, 243) > 0 ? Load<uint64_t>(bytes, 235) : 0;
  for (const uint64_t start : {waveforms, extended_records}) {
    if (start > 0) header->next_records = std::min(header->next_records, start);
  }
  return absl::OkStatus();
}

absl::Status ReadTransform(const ByteSource& source, const std::vector<unsigned char>& bytes,
                           Header* header) {
  for (size_t axis = 0; axis < 3; ++axis) {
    header->scale[axis] = Load<double>(bytes, 131 + 8 * axis);
    header->offset[axis] = Load<double>(bytes, 155 + 8 * axis);
    if (std::isfinite(header->scale[axis]) && std::isfinite(header->offset[axis]) &&
        header->scale[axis] != 0) {
      continue;
    }
    return source.ErrorAtByte(absl::StrCat("the scale of ", std::string(1, "xyz"[axis]),
                                           " must be finite and not 0, and its offset finite"));
  }
  return absl::OkStatus();
}

absl::Status ReadHeader(ByteSource* source, Header* header) {
  std::vector<unsigned char> bytes(kHeader14Bytes);
  if (!source->Read(bytes.data(), 4) || std::memcmp(bytes.data(), "LASF", 4) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(source->name(), ": byte 0: a LAS file starts with LASF"));
  }
  if (!source->Read(bytes.data() + 4, kLasHeaderBytes - 4))
    return source->Truncated("within the header");
  const int major = bytes[24];
  const int minor = bytes[25];
  if (major != 1 || minor > 4) {
    return source->ErrorAtByte(absl::StrCat(
        "LAS ", major, ".", minor, " is not supported; supported versions are 1.0 to 1.4"));
  }
  const int format = bytes[104];
  if (format >= 64) {
    return source->ErrorAtByte(
        "the points are compressed (LAZ); decompress the file first, for example with: laszip -i "
        "IN.laz -o OUT.las");
  }
  header->record_bytes = Load<uint16_t>(bytes, 105);
  if (format > 10) {
    return source->ErrorAtByte(
        absl::StrCat("point format ", format, " is unknown; supported formats are 0 to 10"));
  }
  if (header->record_bytes < kRecordBytes[format]) {
    return source->ErrorAtByte(absl::StrCat("a record of point format ", format, " needs ",
                                            kRecordBytes[format], " bytes, not ",
                                            header->record_bytes));
  }
  header->first_point = Load<uint32_t>(bytes, 96);
  absl::Status status = ReadTransform(*source, bytes, header);
  if (status.ok()) status = ReadLaterFields(source, &bytes);
  if (status.ok()) status = ReadPointCount(*source, bytes, header);
  if (status.ok() && header->first_point < source->offset()) {
    status = source->ErrorAtByte(
        absl::StrCat("the points start at byte ", header->first_point, ", within the header"));
  }
  return status;
}

}  // namespace

absl::Status ReadLas(ByteSource* source, PointCollector* points) {
  Header header;
  if (absl::Status status = ReadHeader(source, &header); !status.ok()) return status;
  if (!source->Skip(header.first_point - source->offset())) {
    return source->Truncated(absl::StrCat("before the points at byte ", header.first_point));
  }
  uint64_t at = source->offset();
  const auto error_at = [&](const std::string& message) {
    return absl::InvalidArgumentError(absl::StrCat(source->name(), ": byte ", at, ": ", message));
  };
  std::vector<unsigned char> record(header.record_bytes);
  for (uint64_t i = 0; i < header.point_count; ++i) {
    at = source->offset();
    if (!source->Read(record.data(), record.size())) {
      return source->Truncated(absl::StrCat("after ", i, " of ", header.point_count, " points"));
    }
    std::array<double, 3> xyz;
    for (size_t axis = 0; axis < 3; ++axis) {
      xyz[axis] = std::fma(LoadScalar(ScalarType::kInt32, record.data() + 4 * axis, false),
                           header.scale[axis], header.offset[axis]);
      if (!std::isfinite(xyz[axis])) return error_at("a coordinate exceeds the largest double");
    }
    absl::Status status = points->Add(xyz[0], xyz[1], xyz[2], error_at);
    if (!status.ok()) return status;
  }
  // An interrupted writer leaves the count too small.
  const uint64_t end = source->offset();
  if (header.next_records <= end) return absl::OkStatus();
  return source->CheckEnd(Counted(header.point_count, "point"), header.record_bytes,
                          header.next_records - end);
}

}  // namespace hulld
