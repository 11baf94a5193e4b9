#ifndef HULLD_CORE_HULL_VERTEX_TABLE_H_
#define HULLD_CORE_HULL_VERTEX_TABLE_H_

#include <cstdint>
#include <vector>

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

  VertexId Add(const Vector& point) {
    const Entry entry = {point, block_, /*duplicates=*/0, /*is_new=*/true};
    VertexId id;
    if (free_.empty()) {
      id = static_cast<VertexId>(entries_.size());
      entries_.push_back(entry);
    } else {
      id = free_.back();
      free_.pop_back();
      entries_[id] = entry;
    }
    ++outside_;
    return id;
  }

  void CountDuplicate(VertexId id) {
    Entry& entry = entries_[id];
    if (entry.block != block_) {
      entry.block = block_;
      entry.duplicates = 0;
      entry.is_new = false;
    }
    ++entry.duplicates;
    ++duplicate_;
  }

  void Remove(VertexId id) {
    const Entry& entry = entries_[id];
    if (entry.block == block_) {
      duplicate_ -= entry.duplicates;
      if (entry.is_new) --outside_;
    }
    free_.push_back(id);
  }

  const Vector& operator[](VertexId id) const { return entries_[id].point; }
  // Vertices that live.
  size_t size() const { return entries_.size() - free_.size(); }
  // IDs lie below this.
  size_t id_bound() const { return entries_.size(); }

 private:
  struct Entry {
    Vector point;
    // The block that the two counts below belong to.
    uint64_t block;
    uint64_t duplicates;
    bool is_new;
  };

  std::vector<Entry> entries_;
  std::vector<VertexId> free_;
  uint64_t block_ = 0;
  uint64_t outside_ = 0;
  uint64_t duplicate_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_VERTEX_TABLE_H_
