#ifndef HULLD_CORE_HULL_SURFACE_VERTEX_TABLE_H_
#define HULLD_CORE_HULL_SURFACE_VERTEX_TABLE_H_

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/hull/surface/chunked_vector.h"
#include "core/numeric/vector.h"

namespace hulld {

using VertexId = uint32_t;

// The vertices of a growing hull, by reusable IDs, and the classification of the points of the
// current block: a point counts as a vertex, or as a duplicate of one, only while that vertex is
// alive.
class VertexTable {
 public:
  // Resets the counts.
  void BeginBlock() {
    ++count_.block;
    count_.outside = 0;
    count_.duplicate = 0;
    added_.clear();
  }
  // Starts a journal: until it ends, all changes can be undone. Requires: no journal.
  void StartJournal() {
    points_.StartJournal();
    counts_.StartJournal();
    free_.StartJournal();
    // The next BeginBlock would clear them.
    added_before_ = std::move(added_);
    count_before_ = count_;
  }
  // Restores the state at the start of the journal, and ends it. Cost: O(changes).
  void Undo() {
    points_.Undo();
    counts_.Undo();
    free_.Undo();
    added_ = std::move(added_before_);
    added_before_ = {};
    count_ = count_before_;
  }
  // Ends the journal and keeps the changes. Cost: O(changes).
  void EndJournal() {
    points_.EndJournal();
    counts_.EndJournal();
    free_.EndJournal();
    added_before_ = {};
  }
  // Memory of the journal beyond the previous state, in bytes.
  size_t JournalBytes() const {
    return points_.JournalBytes() + counts_.JournalBytes() + free_.JournalBytes();
  }
  // Frees the memory of vertices added and removed within the block. Cost: amortized by the
  // vertices added.
  void FinishBlock() {
    if (added_.size() > count_.outside) {
      if (id_bound() <= 8 * added_.size()) {
        added_.clear();
        for (VertexId id = 0; id < id_bound(); ++id) added_.push_back(id);
      }
      KeepNew(added_);
    }
    if (added_.capacity() > 2 * added_.size() + 16) added_.shrink_to_fit();
  }
  uint64_t outside() const { return count_.outside; }
  uint64_t duplicate() const { return count_.duplicate; }

  // -0 is stored as +0.
  VertexId Add(const Vector& given) {
    // Adding +0 turns -0 into +0 and changes nothing else.
    const Vector point = given + Vector::Zero();
    VertexId id;
    if (free_.empty()) {
      HULLD_CHECK(points_.size() < UINT32_MAX);
      id = static_cast<VertexId>(points_.size());
      points_.push_back(point);
      counts_.push_back({count_.block, 0, true, true});
    } else {
      id = free_.back();
      free_.pop_back();
      points_.Mutable(id) = point;
      counts_.Mutable(id) = {count_.block, 0, true, true};
    }
    count_.max_abs_coordinate = std::max(count_.max_abs_coordinate, point.cwiseAbs().maxCoeff());
    ++count_.outside;
    added_.push_back(id);
    return id;
  }

  // Requires: a live vertex.
  void CountDuplicate(VertexId id) {
    HULLD_DCHECK(IsAlive(id));
    Counts& counts = counts_.Mutable(id);
    if (counts.block != count_.block) counts = {count_.block, 0, false, true};
    ++counts.duplicates;
    ++count_.duplicate;
  }

  // Requires: a live vertex.
  void Remove(VertexId id) {
    HULLD_DCHECK(IsAlive(id));
    Counts& counts = counts_.Mutable(id);
    counts.is_alive = false;
    if (counts.block == count_.block) {
      count_.duplicate -= counts.duplicates;
      if (counts.is_new) --count_.outside;
      counts.is_new = false;
    }
    free_.push_back(id);
  }

  const Vector& operator[](VertexId id) const { return points_[id]; }
  // False for an ID that is free or was never assigned.
  bool IsAlive(VertexId id) const { return id < points_.size() && counts_[id].is_alive; }
  // Returns the live vertices that the current block added. Cost: O(points of the block that were
  // vertices at any time).
  std::vector<Vector> NewVertices() const {
    std::vector<VertexId> ids = added_;
    KeepNew(ids);
    std::vector<Vector> vertices;
    vertices.reserve(ids.size());
    for (const VertexId id : ids) vertices.push_back(points_[id]);
    return vertices;
  }
  // Returns all live vertices. Cost: O(id_bound()).
  std::vector<Vector> Vertices() const {
    std::vector<Vector> vertices;
    vertices.reserve(size());
    for (VertexId id = 0; id < id_bound(); ++id) {
      if (IsAlive(id)) vertices.push_back(points_[id]);
    }
    return vertices;
  }
  // Number of live vertices.
  size_t size() const { return points_.size() - free_.size(); }
  // All IDs are below this.
  size_t id_bound() const { return points_.size(); }
  size_t MemoryBytes() const {
    return points_.MemoryBytes() + counts_.MemoryBytes() + free_.MemoryBytes() +
           (added_.capacity() + added_before_.capacity()) * sizeof(VertexId);
  }
  // At least the largest absolute coordinate of all vertices that were ever alive.
  double max_abs_coordinate() const { return count_.max_abs_coordinate; }

 private:
  struct Counts {
    // The block of the next two members.
    uint64_t block;
    uint32_t duplicates;
    bool is_new;
    bool is_alive;
  };

  struct Count {
    double max_abs_coordinate = 0;
    uint64_t block = 0;
    uint64_t outside = 0;
    uint64_t duplicate = 0;
  };

  // Keeps the live vertices that the current block added, ascending and without duplicates.
  void KeepNew(std::vector<VertexId>& ids) const {
    std::erase_if(ids, [this](VertexId id) {
      return counts_[id].block != count_.block || !counts_[id].is_new;
    });
    // An ID occurs twice if one vertex of the block replaced another.
    if (!std::is_sorted(ids.begin(), ids.end())) std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  }

  ChunkedVector<Vector> points_;
  ChunkedVector<Counts> counts_;
  ChunkedVector<VertexId> free_;
  // Added by the current block; some may have been removed.
  std::vector<VertexId> added_;
  Count count_;
  // State at the start of the journal.
  std::vector<VertexId> added_before_;
  Count count_before_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_SURFACE_VERTEX_TABLE_H_
