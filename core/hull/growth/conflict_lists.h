#ifndef HULLD_CORE_HULL_GROWTH_CONFLICT_LISTS_H_
#define HULLD_CORE_HULL_GROWTH_CONFLICT_LISTS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/scratch_list.h"
#include "core/base/stop_poll.h"
#include "core/hull/growth/point_blocks.h"
#include "core/hull/surface/surface.h"
#include "core/hull/surface/vertex_table.h"

namespace hulld {

// Points to be added to a surface, each in the list of a triangle that is strictly visible from it.
//
// An insertion adds the point of a list that is farthest from the list's triangle. The points of
// removed triangles are tested against the new triangles alone, and a point that sees none of them
// is inside. This is exact: the region that a point sees strictly is connected, so a point that saw
// a removed triangle and still sees a remaining one sees both sides of an edge of the horizon,
// hence the new triangle there. Source: Barber, Dobkin and Huhdanpaa 1996, The Quickhull Algorithm
// for Convex Hulls.
class ConflictLists {
 public:
  enum class Outcome {
    kDone,
    // The poll stopped.
    kStopped,
    // Points are moved between lists so often, or so many are outside, that another order of
    // insertion is faster; see TakeRest.
    kGaveUp
  };

  // The poll's steps are single insertions or exact tests. If it stopped, InsertAll returns
  // kStopped, and some pending points may be lost. Requires: a known interior point.
  ConflictLists(Surface& surface, VertexTable& vertices, StopPoll& poll)
      : surface_(surface), vertices_(vertices), poll_(poll) {}

  // Accepts points at any location; counts and drops points inside. Requires: no pending points.
  // Cost: one test per point and triangle of the surface.
  void Take(std::span<const Vector> points);
  // Accepts the outside points of a sample of sample_size points; points[i] sees seen[i] strictly.
  // Requires: no pending points.
  void Take(std::span<const Vector> points, std::span<const TriangleId> seen, size_t sample_size);

  // Adds all pending points.
  Outcome InsertAll();
  // Returns the points not yet added.
  std::vector<Vector> TakeRest();

 private:
  // A range of blocks_. The last block is padded with an inside point, from which no triangle is
  // visible.
  struct List {
    uint32_t first_block = 0;
    uint32_t count = 0;
  };

  std::span<const PointBlock> BlocksOf(const List& list) const {
    return {blocks_.get() + list.first_block, BlocksFor(list.count)};
  }
  Vector PointOf(const List& list, size_t i) const {
    return blocks_[list.first_block + i / PointBlock::kSize].point(i % PointBlock::kSize);
  }
  void Set(const List& list, size_t i, const Vector& p) {
    blocks_[list.first_block + i / PointBlock::kSize].Set(i % PointBlock::kSize, p);
  }
  void MoveLongestToFront();
  bool IsMostlyOutside(size_t insertions);
  void CountTaken(std::span<const Vector> points);
  void InsertFrom(TriangleId id);
  Vector RemoveFarthest(TriangleId id);
  void Distribute(std::span<const TriangleId> targets, bool has_vertices);
  void Match(std::span<const TriangleId> targets, bool has_vertices);
  int64_t MatchExactly(const Vector& point, std::span<const TriangleId> targets);
  void AllocateLists(std::span<const TriangleId> targets);
  void Scatter();
  void Reserve(size_t blocks);

  const Vector& PointInside() const { return surface_.directions()->center(); }

  Surface& surface_;
  VertexTable& vertices_;
  StopPoll& poll_;
  // All lists, with gaps left by removed lists.
  std::unique_ptr<PointBlock[]> blocks_;
  size_t end_ = 0;
  size_t capacity_ = 0;
  // By triangle.
  std::vector<List> lists_;
  // Triangles that have had a list, in the order of processing.
  ScratchList<TriangleId> queue_;
  size_t next_in_queue_ = 0;
  // Number of points in lists, number of accepted points, and number of moves of points between
  // lists.
  size_t waiting_ = 0;
  size_t taken_ = 0;
  size_t moved_ = 0;
  // Number of points of the last sample, including points that were not accepted.
  size_t sample_size_ = 0;
  // True if the first insertions start from the longest lists.
  bool longest_first_ = false;
  // Largest absolute coordinate of a point.
  double size_ = 0;

  // Scratch for a distribution: the lists to empty, their blocks, the targets' planes, the results
  // of MatchPlanes, and, indexed by match + 1, the number of points and the position of the next
  // one.
  std::vector<List> sources_;
  ScratchList<const PointBlock*> source_blocks_;
  std::vector<PlaneWithLimits> planes_;
  ScratchList<int64_t> matches_;
  std::vector<uint32_t> counts_;
  std::vector<size_t> cursors_;
};

}  // namespace hulld

#endif  // HULLD_CORE_HULL_GROWTH_CONFLICT_LISTS_H_
