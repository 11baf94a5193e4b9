#ifndef HULLD_SERVER_STORE_BODY_RECORD_H_
#define HULLD_SERVER_STORE_BODY_RECORD_H_

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/query/terms/pose.h"

namespace hulld::server {

// A body without its pieces.
struct BodyRecord {
  std::string body_id;
  // The store's revision at which it was created, and that at which its pieces were put last.
  uint64_t create_revision = 0;
  uint64_t revision = 0;
};

// A piece of a body: a hull, as an index into the body's list of hulls, and its pose in the frame
// of the body.
struct StoredPiece {
  uint32_t hull = 0;
  Pose X_BP;
};

// All of a body.
struct StoredBody {
  BodyRecord record;
  // The hulls of the pieces, each once, in the order in which they come first.
  std::vector<std::string> hull_ids;
  std::vector<StoredPiece> pieces;

  // In memory.
  size_t MemoryBytes() const;
};

// All but the body's ID, which is the key.
std::string EncodeStoredBody(const StoredBody& body);
// DATA_LOSS: it cannot be.
absl::StatusOr<StoredBody> DecodeStoredBody(std::string_view body_id, std::string_view value);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_BODY_RECORD_H_
