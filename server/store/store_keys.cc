#include "server/store/store_keys.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <cstring>

namespace hulld::server {
namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");
static_assert(sizeof(Vector) == 3 * sizeof(double));

constexpr size_t kChecksumBytes = sizeof(uint32_t);

uint32_t Checksum(std::string_view key, std::string_view value) {
  const auto add = [](uLong sum, std::string_view text) {
    return crc32_z(sum, reinterpret_cast<const Bytef*>(text.data()), text.size());
  };
  return static_cast<uint32_t>(add(add(crc32_z(0, nullptr, 0), key), value));
}

absl::Status WrongSize(std::string_view value) {
  return absl::DataLossError(
      absl::StrCat("a value of ", value.size(), " bytes, which is not a valid size"));
}

// The numbers of a StoredHull, in stored order.
using StoredNumbers = std::array<uint64_t, 13>;

}  // namespace

uint64_t FromBigEndian(std::string_view bytes) {
  uint64_t number = 0;
  for (const char c : bytes) number = number << 8 | static_cast<unsigned char>(c);
  return number;
}

std::string HullKey(std::string_view hull_id) {
  return std::string(1, kHullPrefix).append(hull_id);
}

std::string BodyKey(std::string_view body_id) {
  return std::string(1, kBodyPrefix).append(body_id);
}

std::string IncarnationKey(char prefix, uint64_t incarnation) {
  return std::string(1, prefix).append(BigEndian(incarnation));
}

uint64_t IncarnationOf(std::string_view key) {
  return FromBigEndian(key.substr(1, sizeof(uint64_t)));
}

std::string WriterKey(uint64_t incarnation, std::string_view writer_id) {
  return IncarnationKey(kWriterPrefix, incarnation).append(writer_id);
}

std::string BaseKey(uint64_t incarnation, uint64_t revision, uint32_t part) {
  return IncarnationKey(kBasePrefix, incarnation)
      .append(BigEndian(revision))
      .append(BigEndian(part));
}

std::string DeltaKey(uint64_t incarnation, uint64_t revision) {
  return IncarnationKey(kDeltaPrefix, incarnation).append(BigEndian(revision));
}

uint64_t DeltaRevision(std::string_view key) {
  return FromBigEndian(key.substr(key.size() - sizeof(uint64_t)));
}

std::string Seal(std::string_view key, std::string value) {
  const uint32_t checksum = Checksum(key, value);
  value.append(reinterpret_cast<const char*>(&checksum), kChecksumBytes);
  return value;
}

absl::StatusOr<std::string_view> Unseal(std::string_view key, std::string_view sealed) {
  if (sealed.size() < kChecksumBytes) return WrongSize(sealed);
  const std::string_view value = sealed.substr(0, sealed.size() - kChecksumBytes);
  uint32_t checksum = 0;
  std::memcpy(&checksum, sealed.data() + value.size(), kChecksumBytes);
  if (checksum != Checksum(key, value)) return absl::DataLossError("a checksum does not match");
  return value;
}

std::string EncodeNumber(uint64_t number) {
  return std::string(reinterpret_cast<const char*>(&number), sizeof(number));
}

absl::StatusOr<uint64_t> DecodeNumber(std::string_view value) {
  uint64_t number = 0;
  if (value.size() != sizeof(number)) return WrongSize(value);
  std::memcpy(&number, value.data(), sizeof(number));
  return number;
}

std::string EncodeStoredHull(const StoredHull& hull) {
  const HullRecord& record = hull.record;
  const StoredNumbers numbers = {record.create_revision,
                                 record.revision,
                                 static_cast<uint64_t>(static_cast<int64_t>(record.dimension)),
                                 record.vertex_count,
                                 record.counts.received,
                                 record.counts.outside,
                                 record.counts.duplicate,
                                 record.counts.inside,
                                 hull.writer_count,
                                 hull.layout.base_revision,
                                 hull.layout.base_vertices,
                                 hull.layout.delta_count,
                                 hull.layout.delta_vertices};
  return std::string(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers));
}

absl::StatusOr<StoredHull> DecodeStoredHull(std::string_view hull_id, std::string_view value) {
  StoredNumbers numbers;
  if (value.size() != sizeof(numbers)) return WrongSize(value);
  std::memcpy(numbers.data(), value.data(), sizeof(numbers));
  StoredHull hull;
  hull.record.hull_id = hull_id;
  hull.record.create_revision = numbers[0];
  hull.record.revision = numbers[1];
  hull.record.dimension = static_cast<int>(static_cast<int64_t>(numbers[2]));
  hull.record.vertex_count = numbers[3];
  hull.record.counts = {numbers[4], numbers[5], numbers[6], numbers[7]};
  hull.writer_count = numbers[8];
  hull.layout = {numbers[9], numbers[10], numbers[11], numbers[12]};
  return hull;
}

std::string EncodeVertices(std::span<const Vector> vertices) {
  return std::string(reinterpret_cast<const char*>(vertices.data()), vertices.size_bytes());
}

absl::Status AppendVertices(std::string_view value, std::vector<Vector>* vertices) {
  if (value.size() % sizeof(Vector) != 0) return WrongSize(value);
  const size_t before = vertices->size();
  vertices->resize(before + value.size() / sizeof(Vector));
  if (!value.empty()) std::memcpy((*vertices)[before].data(), value.data(), value.size());
  return absl::OkStatus();
}

}  // namespace hulld::server
