#ifndef HULLD_CORE_HULL_VERTEX_TABLE_H_
#define HULLD_CORE_HULL_VERTEX_TABLE_H_

#include <algorithm>
#include <cstdint>

#include "core/hull/chunked_vector.h"
#include "core/hull/hull.h"

namespace hulld {

using VertexId = uint32_t;

// The vertices of a growing hull, by IDs that are reused, and what became of the points of the
// current block: a point counts as a vertex, or as a duplicate of one, only while that vertex
// lives.
class VertexTable {
 public:
  // Starts counting anew.
  void BeginBlock() {
    ++block_;
    outside_ = 0;
    duplicate_ = 0;
  }
  uint64_t outside() const { return outside_; }
  uint64_t duplicate() const { return duplicate_; }

  // -0 is stored as +0.
  VertexId Add(const Vector& given) {
    // Adding +0 turns -0 into +0 and changes nothing else.
    const Vector point = given + Vector::Zero();
    VertexId id;
    if (free_.empty()) {
      id = static_cast<VertexId>(points_.size());
      points_.push_back(point);
      counts_.push_back({block_, 0, true});
    } else {
      id = free_.back();
      free_.pop_back();
      points_[id] = point;
      counts_[id] = {block_, 0, true};
    }
    max_abs_coordinate_ = std::max(max_abs_coordinate_, point.cwiseAbs().maxCoeff());
    ++outside_;
    return id;
  }

  void CountDuplicate(VertexId id) {
    Counts& counts = counts_[id];
    if (counts.block != block_) counts = {block_, 0, false};
    ++counts.duplicates;
    ++duplicate_;
  }

  void Remove(VertexId id) {
    const Counts& counts = counts_[id];
    if (counts.block == block_) {
      duplicate_ -= counts.duplicates;
      if (counts.is_new) --outside_;
    }
    free_.push_back(id);
  }

  const Vector& operator[](VertexId id) const { return points_[id]; }
  // Vertices that live.
  size_t size() const { return points_.size() - free_.size(); }
  // IDs lie below this.
  size_t id_bound() const { return points_.size(); }
  size_t MemoryBytes() const {
    return points_.MemoryBytes() + counts_.MemoryBytes() + free_.MemoryBytes();
  }
  // Largest absolute coordinate of all vertices that ever lived.
  double max_abs_coordinate() const { return max_abs_coordinate_; }

 private:
  struct Counts {
    // The block that the others belong to.
    uint64_t block;
    uint32_t duplicates;
    bool is_new;
  };

  ChunkedVector<Vector> points_;
  ChunkedVector<Counts> counts_;
  ChunkedVector<VertexId> free_;
  double max_abs_coordinate_ = 0;
  uint64_t block_ = 0;
  uint64_t outside_ = 0;
  uint64_t duplicate_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_VERTEX_TABLE_H_
