#ifndef HULLD_SERVER_STORE_RECORDS_H_
#define HULLD_SERVER_STORE_RECORDS_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/query/terms/pose.h"

namespace hulld::server {

// A hull without its geometry, as of its last committed change.
struct HullRecord {
  std::string hull_id;
  // The store's revision at which this incarnation was created.
  uint64_t create_revision = 0;
  // The store's revision of the last change of its vertex set.
  uint64_t revision = 0;
  int dimension = -1;
  uint64_t vertex_count = 0;
  // Sums over all chunks.
  PointCounts counts;
  friend bool operator==(const HullRecord&, const HullRecord&) = default;
};

// Layout of the stored vertices of a hull: a base, and a delta of the added vertices for each
// change since. The hull is the convex hull of the base and all deltas.
struct VertexLayout {
  // 0: no base.
  uint64_t base_revision = 0;
  uint64_t base_vertices = 0;
  uint64_t delta_count = 0;
  uint64_t delta_vertices = 0;

  bool empty() const { return base_revision == 0 && delta_count == 0; }
  friend bool operator==(const VertexLayout&, const VertexLayout&) = default;
};

// Stored state of a hull without its vertices and its writers' sequences.
struct StoredHull {
  HullRecord record;
  // Writers that committed a chunk.
  uint64_t writer_count = 0;
  VertexLayout layout;
  friend bool operator==(const StoredHull&, const StoredHull&) = default;
};

// Revisions of a hull's incarnation: of its creation, of the last change of its vertex set,
// and of its base.
struct HullRevisions {
  uint64_t create = 0;
  uint64_t change = 0;
  uint64_t base = 0;
};

inline HullRevisions RevisionsOf(const StoredHull& hull) {
  return {hull.record.create_revision, hull.record.revision, hull.layout.base_revision};
}

inline void SetRevisions(const HullRevisions& revisions, StoredHull* hull) {
  hull->record.create_revision = revisions.create;
  hull->record.revision = revisions.change;
  hull->layout.base_revision = revisions.base;
}

// Two versions of a hull's incarnation with the same base: all growth between them is in
// deltas.
struct HullGrowth {
  StoredHull before;
  StoredHull after;
};

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

// A hull or body from its creation or replacement to its end.
struct Incarnation {
  static Incarnation Of(const HullRecord& record) { return {record.create_revision, false}; }
  static Incarnation Of(const BodyRecord& record) { return {record.create_revision, true}; }

  uint64_t create_revision = 0;
  bool is_body = false;

  bool operator==(const Incarnation&) const = default;
};

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_RECORDS_H_
