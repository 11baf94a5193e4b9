#ifndef HULLD_SERVER_STORE_SEALED_HULL_H_
#define HULLD_SERVER_STORE_SEALED_HULL_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/store/body_record.h"
#include "server/store/hull_record.h"

// Decoding and checking of stored hulls and bodies. Every durable store seals its values as
// described in store_keys.h.
namespace hulld::server {

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

#endif  // HULLD_SERVER_STORE_SEALED_HULL_H_
