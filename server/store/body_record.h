#ifndef HULLD_SERVER_STORE_BODY_RECORD_H_
#define HULLD_SERVER_STORE_BODY_RECORD_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/query/terms/pose.h"

namespace hulld::server {

// A body without its pieces.
struct BodyRecord {
  std::string body_id;
  // Store revisions of its creation and of the last put of its pieces.
  uint64_t create_revision = 0;
  uint64_t revision = 0;
};

// A piece of a body: a hull, as an index into the body's list of hulls, its pose in the frame of
// the body, and its radius.
struct StoredPiece {
  uint32_t hull = 0;
  Pose X_BP;
  double radius = 0;
};

// A body with its pieces.
struct StoredBody {
  BodyRecord record;
  // Distinct hulls of the pieces, in order of first use.
  std::vector<std::string> hull_ids;
  std::vector<StoredPiece> pieces;

  size_t MemoryBytes() const {
    size_t bytes = sizeof(*this) + pieces.capacity() * sizeof(StoredPiece);
    for (const std::string& id : hull_ids) bytes += sizeof(std::string) + id.capacity();
    return bytes;
  }
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_BODY_RECORD_H_
