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

// What a store keeps of one hull or body, read back and checked. Every store that keeps hulls seals
// its values as store_keys.h says, wherever it puts them.
namespace hulld::server {

// A hull's record. DATA_LOSS naming the hull: it is damaged.
absl::StatusOr<StoredHull> UnsealStoredHull(const std::string& hull_id, std::string_view sealed);

// The same for a body.
absl::StatusOr<StoredBody> UnsealStoredBody(const std::string& body_id, std::string_view sealed);

// The sequence of a writer of the hull; key: as WriterKey makes it. DATA_LOSS, as for the record.
absl::StatusOr<uint64_t> UnsealSequence(const std::string& hull_id, std::string_view key,
                                        std::string_view sealed);

// Puts the vertices of a hull together: first the parts of its base in their order, then its
// deltas.
class VertexAssembly {
 public:
  // `hull` must outlive this.
  explicit VertexAssembly(const StoredHull& hull);

  bool wants_base_part() const { return vertices_.size() < hull_.layout.base_vertices; }
  // The number of the next part.
  uint32_t next_part() const { return next_part_; }
  // value: without its checksum, or why there is none, which is returned.
  absl::Status AddBasePart(const absl::StatusOr<std::string_view>& value);
  // The same. Requires all parts of the base, which Finish checks.
  absl::Status AddDelta(uint64_t revision, const absl::StatusOr<std::string_view>& value);

  // The vertices. status: that of reading them. DATA_LOSS naming the hull: something is damaged, or
  // it is not what the hull's record says.
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
