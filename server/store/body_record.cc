#include "server/store/body_record.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace hulld::server {
namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

// Reads an encoded body. Missing values read as zero or empty, and make ok() false.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <typename Number>
  Number Next() {
    Number number{};
    const std::string_view bytes = NextBytes(sizeof(number));
    if (!bytes.empty()) std::memcpy(&number, bytes.data(), sizeof(number));
    return number;
  }
  std::string NextText() { return std::string(NextBytes(Next<uint64_t>())); }
  // Reads a number of entries of at least this many bytes each; 0, and not ok(), if the remaining
  // bytes are too few.
  uint64_t NextCount(size_t min_bytes) {
    const uint64_t count = Next<uint64_t>();
    ok_ = ok_ && count <= rest_.size() / min_bytes;
    return ok_ ? count : 0;
  }
  bool ok() const { return ok_; }
  bool at_end() const { return rest_.empty(); }

 private:
  std::string_view NextBytes(uint64_t count) {
    ok_ = ok_ && count <= rest_.size();
    if (!ok_) return {};
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }

  std::string_view rest_;
  bool ok_ = true;
};

constexpr size_t kPieceBytes = sizeof(uint32_t) + 7 * sizeof(double);

}  // namespace

size_t StoredBody::MemoryBytes() const {
  size_t bytes = sizeof(*this) + pieces.capacity() * sizeof(StoredPiece);
  for (const std::string& id : hull_ids) bytes += sizeof(std::string) + id.capacity();
  return bytes;
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
  const uint64_t hulls = reader.NextCount(sizeof(uint64_t));
  for (uint64_t i = 0; i < hulls; ++i) body.hull_ids.push_back(reader.NextText());
  const uint64_t pieces = reader.NextCount(kPieceBytes);
  for (uint64_t i = 0; i < pieces && reader.ok(); ++i) {
    StoredPiece& piece = body.pieces.emplace_back();
    piece.hull = reader.Next<uint32_t>();
    for (double& component : piece.X_BP.q) component = reader.Next<double>();
    for (int k = 0; k < 3; ++k) piece.X_BP.t[k] = reader.Next<double>();
    if (piece.hull >= hulls || !IsValidPose(piece.X_BP)) {
      return absl::DataLossError(absl::StrCat("its piece ", i, " is invalid"));
    }
  }
  const bool has_radii = !reader.at_end();
  for (uint64_t i = 0; i < pieces && reader.ok() && has_radii; ++i) {
    double& radius = body.pieces[i].radius;
    radius = reader.Next<double>();
    if (!(radius >= 0 && std::isfinite(radius))) {
      return absl::DataLossError(absl::StrCat("the radius of its piece ", i, " is invalid"));
    }
  }
  if (!reader.ok() || !reader.at_end()) {
    return absl::DataLossError(
        absl::StrCat("a value of ", value.size(), " bytes, which is not a valid size"));
  }
  return body;
}

}  // namespace hulld::server
