#ifndef HULLD_SERVER_STORE_STORE_KEYS_H_
#define HULLD_SERVER_STORE_STORE_KEYS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/store/records.h"

namespace hulld::server {

// Keys and values of the durable store. Numbers in keys are big endian, so that byte order is
// numeric order; numbers in values are little endian.
//
//   m/format, m/store_id, m/revision     of the store
//   m/relaxed                            while --durability=relaxed has it open; without a value
//   m/lost                               while vertices or writers of deleted hulls with damaged
//                                        records may exist; without a value
//   m/migration                          while a migration fills the store: the revision of its
//                                        source, and that store's ID
//   h<hull ID>                           a StoredHull
//   w<incarnation><writer ID>            the writer's last committed sequence
//   b<incarnation><revision><part>       vertices of a base, in parts
//   d<incarnation><revision>             vertices of a delta
//   p<body ID>                           a StoredBody
//
// An incarnation is a create_revision. Every value ends with the CRC-32 of key and value, so that
// readers recognize a value that is damaged or belongs to another key.

// Version of this format. A store without bodies may be in format 1, which is the same otherwise. A
// store in any other format is refused.
inline constexpr uint64_t kStoreFormat = 2;
inline constexpr uint64_t kFormatWithoutBodies = 1;
inline constexpr char kFormatKey[] = "m/format";
inline constexpr char kStoreIdKey[] = "m/store_id";
inline constexpr char kRevisionKey[] = "m/revision";
inline constexpr char kRelaxedKey[] = "m/relaxed";
inline constexpr char kLostKey[] = "m/lost";
inline constexpr char kMigrationKey[] = "m/migration";
inline constexpr char kHullPrefix = 'h';
inline constexpr char kWriterPrefix = 'w';
inline constexpr char kBasePrefix = 'b';
inline constexpr char kDeltaPrefix = 'd';
inline constexpr char kBodyPrefix = 'p';
// Vertices per part of a base: 768 KiB.
inline constexpr size_t kBasePartVertices = 32768;

// Converts a number to bytes, most significant first, and back.
template <typename T>
std::string BigEndian(T number) {
  std::string bytes(sizeof(T), '\0');
  for (size_t i = 0; i < sizeof(T); ++i) {
    bytes[i] = static_cast<char>(number >> (8 * (sizeof(T) - 1 - i)));
  }
  return bytes;
}
uint64_t FromBigEndian(std::string_view bytes);

std::string HullKey(std::string_view hull_id);
std::string BodyKey(std::string_view body_id);
// Lower bound of an incarnation's keys of one kind. IncarnationKey(prefix, incarnation + 1) is the
// upper bound.
std::string IncarnationKey(char prefix, uint64_t incarnation);
// Returns the incarnation in one of the keys below.
uint64_t IncarnationOf(std::string_view key);
std::string WriterKey(uint64_t incarnation, std::string_view writer_id);
std::string BaseKey(uint64_t incarnation, uint64_t revision, uint32_t part);
std::string DeltaKey(uint64_t incarnation, uint64_t revision);
// Returns the revision in a DeltaKey.
uint64_t DeltaRevision(std::string_view key);

// Returns the value with its checksum appended.
std::string Seal(std::string_view key, std::string value);
// Returns the value without its checksum. DATA_LOSS: the checksum does not match.
absl::StatusOr<std::string_view> Unseal(std::string_view key, std::string_view sealed);

std::string EncodeNumber(uint64_t number);
// DATA_LOSS: the value has the wrong size. The same holds for the decoders below.
absl::StatusOr<uint64_t> DecodeNumber(std::string_view value);
// Encodes all fields but the ID, which is the key.
std::string EncodeStoredHull(const StoredHull& hull);
absl::StatusOr<StoredHull> DecodeStoredHull(std::string_view hull_id, std::string_view value);
// Encodes all fields but the ID, as binary numbers and length-prefixed strings. The radii of the
// pieces follow unless all are 0.
std::string EncodeStoredBody(const StoredBody& body);
absl::StatusOr<StoredBody> DecodeStoredBody(std::string_view body_id, std::string_view value);
std::string EncodeVertices(std::span<const Vector> vertices);
absl::Status AppendVertices(std::string_view value, std::vector<Vector>* vertices);

// Returns the record of a hull. DATA_LOSS naming the hull: it is damaged.
absl::StatusOr<StoredHull> UnsealStoredHull(const std::string& hull_id, std::string_view sealed);

// Returns a body. DATA_LOSS naming the body: it is damaged.
absl::StatusOr<StoredBody> UnsealStoredBody(const std::string& body_id, std::string_view sealed);

// Returns the sequence of a writer of the hull. key: WriterKey of both. DATA_LOSS naming the hull:
// it is damaged.
absl::StatusOr<uint64_t> UnsealSequence(const std::string& hull_id, std::string_view key,
                                        std::string_view sealed);

// Assembles the vertices of a hull: first the parts of its base, then its deltas, in order.
class VertexAssembly {
 public:
  // `hull` must outlive this.
  explicit VertexAssembly(const StoredHull& hull);

  bool wants_base_part() const { return vertices_.size() < hull_.layout.base_vertices; }
  // The number of the next part.
  uint32_t next_part() const { return next_part_; }
  // value: without its checksum, or an error, which is returned.
  absl::Status AddBasePart(const absl::StatusOr<std::string_view>& value);
  // Adds a delta in the same way. Requires: all parts of the base were added (checked by Finish).
  absl::Status AddDelta(uint64_t revision, const absl::StatusOr<std::string_view>& value);

  // Returns the vertices. status: the result of reading them. DATA_LOSS naming the hull: a value is
  // damaged or contradicts the hull's record.
  absl::StatusOr<std::vector<Vector>> Finish(absl::Status status) &&;

 private:
  absl::Status Check() const;

  const StoredHull& hull_;
  std::vector<Vector> vertices_;
  uint32_t next_part_ = 0;
  uint64_t base_vertices_ = 0;
  uint64_t deltas_ = 0;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_STORE_KEYS_H_
