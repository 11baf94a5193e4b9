#include "server/store/store_keys.h"

#include <absl/strings/str_cat.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "server/contract/errors.h"
#include "server/store/store_errors.h"

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

// Reads an encoded body. Missing values read as zero or empty, and make ok() false.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  std::string_view NextBytes(uint64_t count) {
    ok_ = ok_ && count <= rest_.size();
    const std::string_view bytes = rest_.substr(0, ok_ ? count : 0);
    rest_.remove_prefix(bytes.size());
    return bytes;
  }
  template <typename Number>
  Number Next() {
    Number number{};
    const std::string_view bytes = NextBytes(sizeof(number));
    std::memcpy(&number, bytes.data(), bytes.size());
    return number;
  }
  bool ok() const { return ok_; }
  bool at_end() const { return rest_.empty(); }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

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

std::string EncodeStoredBody(const StoredBody& body) {
  std::string bytes;
  const auto add = [&bytes](auto number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  add(body.record.create_revision);
  add(body.record.revision);
  add(uint64_t{body.hull_ids.size()});
  for (const std::string& id : body.hull_ids) {
    add(uint64_t{id.size()});
    bytes += id;
  }
  add(uint64_t{body.pieces.size()});
  for (const StoredPiece& piece : body.pieces) {
    add(piece.hull);
    for (const double component : piece.X_BP.q) add(component);
    for (const double component : piece.X_BP.t) add(component);
  }
  const auto is_rounded = [](const StoredPiece& piece) { return piece.radius > 0; };
  if (std::ranges::any_of(body.pieces, is_rounded)) {
    for (const StoredPiece& piece : body.pieces) add(piece.radius);
  }
  return bytes;
}

absl::StatusOr<StoredBody> DecodeStoredBody(std::string_view body_id, std::string_view value) {
  Reader reader(value);
  StoredBody body;
  body.record.body_id = body_id;
  body.record.create_revision = reader.Next<uint64_t>();
  body.record.revision = reader.Next<uint64_t>();
  const auto hulls = reader.Next<uint64_t>();
  for (uint64_t i = 0; i < hulls && reader.ok(); ++i) {
    body.hull_ids.emplace_back(reader.NextBytes(reader.Next<uint64_t>()));
  }
  const auto pieces = reader.Next<uint64_t>();
  for (uint64_t i = 0; i < pieces && reader.ok(); ++i) {
    StoredPiece& piece = body.pieces.emplace_back();
    piece.hull = reader.Next<uint32_t>();
    for (double& component : piece.X_BP.q) component = reader.Next<double>();
    for (int k = 0; k < 3; ++k) piece.X_BP.t[k] = reader.Next<double>();
    if (reader.ok() && (piece.hull >= hulls || !IsValidPose(piece.X_BP))) {
      return absl::DataLossError(absl::StrCat("its piece ", i, " is invalid"));
    }
  }
  const bool has_radii = reader.ok() && !reader.at_end();
  for (uint64_t i = 0; i < pieces && has_radii; ++i) {
    double& radius = body.pieces[i].radius;
    radius = reader.Next<double>();
    if (!(radius >= 0 && std::isfinite(radius))) {
      return absl::DataLossError(absl::StrCat("the radius of its piece ", i, " is invalid"));
    }
  }
  if (!reader.ok() || !reader.at_end()) return WrongSize(value);
  return body;
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

absl::StatusOr<StoredHull> UnsealStoredHull(const std::string& hull_id, std::string_view sealed) {
  const absl::StatusOr<std::string_view> value = Unseal(HullKey(hull_id), sealed);
  absl::StatusOr<StoredHull> hull = value.ok() ? DecodeStoredHull(hull_id, *value) : value.status();
  if (!hull.ok()) return DamagedHull(hull_id, std::string(hull.status().message()));
  return hull;
}

absl::StatusOr<uint64_t> UnsealSequence(const std::string& hull_id, std::string_view key,
                                        std::string_view sealed) {
  const absl::StatusOr<std::string_view> value = Unseal(key, sealed);
  absl::StatusOr<uint64_t> sequence = value.ok() ? DecodeNumber(*value) : value.status();
  if (sequence.ok()) return sequence;
  return DamagedHull(hull_id, absl::StrCat("a writer's sequence: ", sequence.status().message()));
}

absl::StatusOr<StoredBody> UnsealStoredBody(const std::string& body_id, std::string_view sealed) {
  const absl::StatusOr<std::string_view> value = Unseal(BodyKey(body_id), sealed);
  absl::StatusOr<StoredBody> body = value.ok() ? DecodeStoredBody(body_id, *value) : value.status();
  if (!body.ok()) return DamagedBody(body_id, std::string(body.status().message()));
  return body;
}

VertexAssembly::VertexAssembly(const StoredHull& hull) : hull_(hull) {
  vertices_.reserve(hull.layout.base_vertices + hull.layout.delta_vertices);
}

absl::Status VertexAssembly::AddBasePart(const absl::StatusOr<std::string_view>& value) {
  const uint32_t part = next_part_++;
  absl::Status status = value.status();
  if (value.ok()) {
    status =
        value->empty() ? absl::DataLossError("it is empty") : AppendVertices(*value, &vertices_);
    base_vertices_ = vertices_.size();
  }
  if (status.ok()) return status;
  return Prefixed(absl::StrCat("part ", part, " of its base: "), status);
}

absl::Status VertexAssembly::AddDelta(uint64_t revision,
                                      const absl::StatusOr<std::string_view>& value) {
  ++deltas_;
  const absl::Status status = value.ok() ? AppendVertices(*value, &vertices_) : value.status();
  if (status.ok()) return status;
  return Prefixed(absl::StrCat("its delta of revision ", revision, ": "), status);
}

absl::Status VertexAssembly::Check() const {
  const VertexLayout& layout = hull_.layout;
  if (base_vertices_ != layout.base_vertices) {
    return absl::DataLossError(
        absl::StrCat("its base has ", base_vertices_, " vertices, not ", layout.base_vertices));
  }
  const uint64_t delta_vertices = vertices_.size() - base_vertices_;
  if (deltas_ == layout.delta_count && delta_vertices == layout.delta_vertices) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("it has ", deltas_, " deltas with ", delta_vertices,
                                          " vertices, not ", layout.delta_count, " with ",
                                          layout.delta_vertices));
}

absl::StatusOr<std::vector<Vector>> VertexAssembly::Finish(absl::Status status) && {
  if (status.ok()) status = Check();
  if (absl::IsDataLoss(status)) {
    return DamagedHull(hull_.record.hull_id, std::string(status.message()));
  }
  if (!status.ok()) return status;
  return std::move(vertices_);
}

}  // namespace hulld::server
