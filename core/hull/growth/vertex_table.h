#ifndef HULLD_CORE_HULL_GROWTH_VERTEX_TABLE_H_
#define HULLD_CORE_HULL_GROWTH_VERTEX_TABLE_H_

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/hull/growth/chunked_vector.h"
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
    added_.clear();
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
    added_.push_back(id);
    return id;
  }

  void CountDuplicate(VertexId id) {
    Counts& counts = counts_[id];
    if (counts.block != block_) counts = {block_, 0, false};
    ++counts.duplicates;
    ++duplicate_;
  }

  void Remove(VertexId id) {
    Counts& counts = counts_[id];
    if (counts.block == block_) {
      duplicate_ -= counts.duplicates;
      if (counts.is_new) --outside_;
      counts.is_new = false;
    }
    free_.push_back(id);
  }

  // IDs for one thread to add and remove vertices by while others do so in theirs, and what became
  // of points meanwhile. A thread may remove and count only vertices that no other one does.
  struct Zone {
    std::vector<VertexId> free;
    std::vector<VertexId> added;
    VertexId next = 0;
    VertexId end = 0;
    int64_t outside = 0;
    int64_t duplicate = 0;
  };
  Zone AddZone(size_t points) {
    Zone zone;
    zone.next = static_cast<VertexId>(points_.size());
    for (size_t k = 0; k < points; ++k) {
      points_.Extend();
      counts_.Extend();
    }
    zone.end = static_cast<VertexId>(points_.size());
    return zone;
  }
  // Requires room, and that EnlargeMaxAbsCoordinate knows the point's coordinates.
  VertexId Add(const Vector& given, Zone& zone) {
    VertexId id = zone.next;
    if (zone.free.empty()) {
      ++zone.next;
    } else {
      id = zone.free.back();
      zone.free.pop_back();
    }
    points_[id] = given + Vector::Zero();
    counts_[id] = {block_, 0, true};
    ++zone.outside;
    zone.added.push_back(id);
    return id;
  }
  void CountDuplicate(VertexId id, Zone& zone) {
    Counts& counts = counts_[id];
    if (counts.block != block_) counts = {block_, 0, false};
    ++counts.duplicates;
    ++zone.duplicate;
  }
  void Remove(VertexId id, Zone& zone) {
    Counts& counts = counts_[id];
    if (counts.block == block_) {
      zone.duplicate -= counts.duplicates;
      if (counts.is_new) --zone.outside;
      counts.is_new = false;
    }
    zone.free.push_back(id);
  }
  // Takes back what a zone did not use, and its counts.
  void RemoveZone(const Zone& zone) {
    for (VertexId id = zone.next; id < zone.end; ++id) free_.push_back(id);
    for (const VertexId id : zone.free) free_.push_back(id);
    added_.insert(added_.end(), zone.added.begin(), zone.added.end());
    outside_ = static_cast<uint64_t>(static_cast<int64_t>(outside_) + zone.outside);
    duplicate_ = static_cast<uint64_t>(static_cast<int64_t>(duplicate_) + zone.duplicate);
  }
  void EnlargeMaxAbsCoordinate(double value) {
    max_abs_coordinate_ = std::max(max_abs_coordinate_, value);
  }

  const Vector& operator[](VertexId id) const { return points_[id]; }
  // The vertices that the current block added and that live.
  // Cost: O(points of the block that were vertices at any time).
  std::vector<Vector> NewVertices() const {
    std::vector<VertexId> ids = added_;
    std::erase_if(
        ids, [this](VertexId id) { return counts_[id].block != block_ || !counts_[id].is_new; });
    // An ID comes twice where one vertex of the block took the place of another.
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    std::vector<Vector> vertices;
    vertices.reserve(ids.size());
    for (const VertexId id : ids) vertices.push_back(points_[id]);
    return vertices;
  }
  // All that live. Cost: O(id_bound()).
  std::vector<Vector> Vertices() const {
    std::vector<bool> lives(id_bound(), true);
    for (size_t i = 0; i < free_.size(); ++i) lives[free_[i]] = false;
    std::vector<Vector> vertices;
    vertices.reserve(size());
    for (VertexId id = 0; id < id_bound(); ++id) {
      if (lives[id]) vertices.push_back(points_[id]);
    }
    return vertices;
  }
  // Vertices that live.
  size_t size() const { return points_.size() - free_.size(); }
  // IDs lie below this.
  size_t id_bound() const { return points_.size(); }
  size_t MemoryBytes() const {
    return points_.MemoryBytes() + counts_.MemoryBytes() + free_.MemoryBytes() +
           added_.capacity() * sizeof(VertexId);
  }
  // At least the largest absolute coordinate of all vertices that ever lived.
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
  // By the current block; some of them are gone again.
  std::vector<VertexId> added_;
  double max_abs_coordinate_ = 0;
  uint64_t block_ = 0;
  uint64_t outside_ = 0;
  uint64_t duplicate_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_VERTEX_TABLE_H_
