#include "core/hull/growth/conflict_lists.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"

namespace hulld {
namespace {

// Poll steps for one insertion, which also moves the points of the lists that it changes.
constexpr uint64_t kStepsPerInsertion = 4;
// Number of insertions after which it is clear whether most points are inside. On a small surface,
// these start from the longest list.
constexpr size_t kTrialInsertions = 24;
// Average moves of a point above which another order of insertion is better. Observed: at most 8
// for clouds and meshes with most points inside.
constexpr size_t kMaxMoves = 32;

}  // namespace

void ConflictLists::Take(std::span<const Vector> points) {
  CountTaken(points);
  sample_size_ = points.size();
  longest_first_ = true;
  std::vector<TriangleId> targets;
  surface_.ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) { targets.push_back(id); });
  sources_.clear();
  Reserve(BlocksFor(points.size()));
  const List all = {static_cast<uint32_t>(end_), static_cast<uint32_t>(points.size())};
  end_ += BlocksFor(points.size());
  if (!points.empty()) blocks_[end_ - 1].Fill(PointInside());
  for (size_t i = 0; i < points.size(); ++i) {
    blocks_[all.first_block + i / PointBlock::kSize].Set(i % PointBlock::kSize, points[i]);
  }
  sources_.push_back(all);
  Distribute(targets, true);
}

void ConflictLists::Take(std::span<const Vector> points, std::span<const TriangleId> seen,
                         size_t sample_size) {
  HULLD_CHECK(points.size() == seen.size());
  CountTaken(points);
  sample_size_ = sample_size;
  longest_first_ = false;
  std::vector<TriangleId> targets;
  // Position among the targets, from 1, by triangle.
  std::vector<uint32_t> place(surface_.id_bound(), 0);
  counts_.assign(1, 0);
  for (const TriangleId id : seen) {
    if (place[id] == 0) {
      targets.push_back(id);
      place[id] = static_cast<uint32_t>(targets.size());
      counts_.push_back(0);
    }
    ++counts_[place[id]];
  }
  sources_.clear();
  Reserve(BlocksFor(points.size()) + targets.size() + 1);
  AllocateLists(targets);
  for (size_t i = 0; i < points.size(); ++i) {
    const size_t at = cursors_[place[seen[i]]]++;
    blocks_[at / PointBlock::kSize].Set(at % PointBlock::kSize, points[i]);
  }
}

void ConflictLists::CountTaken(std::span<const Vector> points) {
  HULLD_CHECK(waiting_ == 0);
  for (const Vector& p : points) size_ = std::max(size_, p.cwiseAbs().maxCoeff());
  taken_ += points.size();
  waiting_ += points.size();
  lists_.resize(surface_.id_bound());
}

ConflictLists::Outcome ConflictLists::InsertAll() {
  size_t insertions = 0;
  for (; next_in_queue_ < queue_.size(); ++next_in_queue_) {
    if (longest_first_ && insertions < kTrialInsertions) MoveLongestToFront();
    const TriangleId id = queue_[next_in_queue_];
    if (lists_[id].count == 0) continue;
    if (poll_.Step(kStepsPerInsertion + surface_.TakeSteps())) return Outcome::kStopped;
    ++insertions;
    InsertFrom(id);
    if (moved_ > kMaxMoves * taken_ || IsMostlyOutside(insertions)) return Outcome::kGaveUp;
  }
  return poll_.stopped() ? Outcome::kStopped : Outcome::kDone;
}

// Moves the triangle with the longest list to the front of the queue. In another order, the first
// insertions may be at slivers of the first surface, and most points are moved many times.
// **Observed**: longest first, 5000 points of a cube take 0.4 to 0.9 of the time of queue order,
// and other clouds and meshes of 500 to 8192 points at most 1.02.
void ConflictLists::MoveLongestToFront() {
  const auto is_shorter = [this](TriangleId a, TriangleId b) {
    return lists_[a].count < lists_[b].count;
  };
  TriangleId* const front = queue_.data() + next_in_queue_;
  std::swap(*front, *std::max_element(front, queue_.end(), is_shorter));
}

// True if most points are outside, judged after the first insertions. These add far points, so if
// most of a cloud is not inside by then, it never will be.
bool ConflictLists::IsMostlyOutside(size_t insertions) {
  if (insertions != kTrialInsertions) return false;
  return 8 * (waiting_ + insertions) > 7 * sample_size_;
}

std::vector<Vector> ConflictLists::TakeRest() {
  std::vector<Vector> rest;
  for (List& list : lists_) {
    for (size_t i = 0; i < list.count; ++i) rest.push_back(PointOf(list, i));
    list.count = 0;
  }
  return rest;
}

// Adds the farthest point of a triangle's list.
void ConflictLists::InsertFrom(TriangleId id) {
  const Vector apex = RemoveFarthest(id);
  sources_.clear();
  for (const TriangleId gone : surface_.RemoveVisible(vertices_, apex, id)) {
    List& list = lists_[gone];
    if (list.count > 0) sources_.push_back(std::exchange(list, {}));
  }
  const std::span<const TriangleId> targets = surface_.JoinToBoundary(vertices_, apex);
  if (lists_.size() < surface_.id_bound()) lists_.resize(2 * surface_.id_bound());
  if (!sources_.empty()) Distribute(targets, false);
}

// Requires: a non-empty list.
Vector ConflictLists::RemoveFarthest(TriangleId id) {
  List& list = lists_[id];
  HULLD_CHECK(list.count > 0);
  const size_t i = FarthestAlong(BlocksOf(list), list.count, surface_.triangle(id).normal);
  const size_t last = list.count - 1;
  const Vector farthest = PointOf(list, i);
  Set(list, i, PointOf(list, last));
  Set(list, last, PointInside());
  --list.count;
  --waiting_;
  return farthest;
}

// Moves the points of sources_ to targets that they see; points that see none are inside.
// has_vertices: true if points may equal vertices other than the apex of all targets.
void ConflictLists::Distribute(std::span<const TriangleId> targets, bool has_vertices) {
  size_t points = 0;
  for (const List& source : sources_) points += source.count;
  moved_ += points;
  // One block beyond the lists receives the points that are inside.
  Reserve(BlocksFor(points) + targets.size() + 1);
  source_blocks_.clear();
  for (const List& source : sources_) {
    for (const PointBlock& block : BlocksOf(source)) source_blocks_.push_back(&block);
  }
  Match(targets, has_vertices);
  counts_.assign(targets.size() + 1, 0);
  const size_t lanes = source_blocks_.size() * PointBlock::kSize;
  for (size_t i = 0; i < lanes; ++i) ++counts_[static_cast<size_t>(matches_[i] + 1)];
  waiting_ = waiting_ - points + (lanes - counts_[0]);
  AllocateLists(targets);
  Scatter();
}

// Fills matches_, block by block of the sources, with indices of targets or kBelowAll.
//
// The limits of a plane are offset + bound and offset - bound. Rounding them errs by at most 6 u
// |e||f| |corner|, which the slack of kPlaneErrorFactor covers. With slope 0, the test is exact: a
// point of the plane is not above it, and only duplicates of vertices need MatchExactly, which
// counts them. Duplicates of the apex lie in all target planes, so any inexact one finds them.
void ConflictLists::Match(std::span<const TriangleId> targets, bool has_vertices) {
  const double size = surface_.SizeWith(vertices_, Vector::Constant(size_));
  const bool are_exact = std::all_of(targets.begin(), targets.end(), [this](TriangleId id) {
    return surface_.triangle(id).slope == 0;
  });
  planes_.clear();
  for (const TriangleId id : targets) {
    const SurfaceTriangle& t = surface_.triangle(id);
    double above = t.offset;
    double below = t.offset;
    if (t.slope != 0) {
      const double bound = static_cast<double>(t.slope) * size;
      above += bound;
      below -= bound;
    } else if (!has_vertices && !are_exact) {
      below = std::nextafter(below, INFINITY);
    }
    planes_.push_back({{t.normal.x(), t.normal.y(), t.normal.z()}, above, below});
  }
  const size_t lanes = source_blocks_.size() * PointBlock::kSize;
  matches_.MakeRoom(lanes, 0);
  if (!MatchPlanes({source_blocks_.data(), source_blocks_.size()}, planes_, matches_.data())) {
    return;
  }
  int64_t* match = matches_.data();
  for (const List& source : sources_) {
    const size_t room = BlocksFor(source.count) * PointBlock::kSize;
    for (size_t i = 0; i < room; ++i, ++match) {
      if (*match != kUncertain) continue;
      const bool is_filling = i >= source.count;
      *match = is_filling || poll_.Step() ? kBelowAll : MatchExactly(PointOf(source, i), targets);
    }
  }
}

// Copies the points of sources_ to the lists of their matches, without branching on the match:
// points inside are written to a place that never advances.
void ConflictLists::Scatter() {
  const int64_t* matches = matches_.data();
  size_t* const cursors = cursors_.data();
  PointBlock* const blocks = blocks_.get();
  for (const PointBlock* const block : source_blocks_) {
    for (size_t i = 0; i < PointBlock::kSize; ++i) {
      const auto match = static_cast<size_t>(matches[i] + 1);
      const size_t at = cursors[match];
      cursors[match] += match != 0;
      blocks[at / PointBlock::kSize].Set(at % PointBlock::kSize, block->point(i));
    }
    matches += PointBlock::kSize;
  }
}

// Returns the index of a target that the point sees, or kBelowAll if there is none. Counts the
// point if it equals a vertex.
int64_t ConflictLists::MatchExactly(const Vector& point, std::span<const TriangleId> targets) {
  for (size_t k = 0; k < targets.size(); ++k) {
    if (IsCertainlyBelow(planes_[k], point)) continue;
    if (const auto corner = surface_.CornerAt(vertices_, targets[k], point)) {
      vertices_.CountDuplicate(*corner);
      return kBelowAll;
    }
    if (surface_.IsSeenFrom(vertices_, targets[k], point)) return static_cast<int64_t>(k);
  }
  return kBelowAll;
}

// Gives each target a list with room for counts_[k + 1] points, and points cursors_[k + 1] to it;
// cursors_[0] points to a block beyond all lists. Requires: Reserve has made room.
void ConflictLists::AllocateLists(std::span<const TriangleId> targets) {
  cursors_.resize(targets.size() + 1);
  queue_.MakeRoom(queue_.size() + targets.size(), queue_.size());
  TriangleId* queued = queue_.end();
  const Vector inside = PointInside();
  for (size_t k = 0; k < targets.size(); ++k) {
    const uint32_t count = counts_[k + 1];
    const size_t blocks = BlocksFor(count);
    cursors_[k + 1] = end_ * PointBlock::kSize;
    // Branch-free because it is unpredictable whether a target gets points: an empty list fills a
    // free block.
    HULLD_DCHECK(end_ + blocks < capacity_);
    lists_[targets[k]] = {static_cast<uint32_t>(end_), count};
    *queued = targets[k];
    queued += count > 0;
    // The last block may be partly filled.
    blocks_[end_ + std::max(blocks, size_t{1}) - 1].Fill(inside);
    end_ += blocks;
  }
  queue_.SetSize(static_cast<size_t>(queued - queue_.data()));
  HULLD_CHECK(end_ < capacity_);
  cursors_[0] = end_ * PointBlock::kSize;
}

// Makes room for this many blocks at the end, by removing the gaps.
void ConflictLists::Reserve(size_t blocks) {
  if (end_ + blocks <= capacity_) return;
  size_t kept = 0;
  for (const List& list : lists_) kept += BlocksFor(list.count);
  for (const List& list : sources_) kept += BlocksFor(list.count);
  // Spare room makes moves of all blocks rarer; most of it is never touched.
  capacity_ = 4 * (kept + blocks);
  // Lists store block numbers in 32 bits.
  HULLD_CHECK(capacity_ <= UINT32_MAX);
  auto packed = std::make_unique_for_overwrite<PointBlock[]>(capacity_);
  end_ = 0;
  const auto move = [&](List& list) {
    const std::span<const PointBlock> old = BlocksOf(list);
    std::copy(old.begin(), old.end(), packed.get() + end_);
    list.first_block = static_cast<uint32_t>(end_);
    end_ += old.size();
  };
  for (List& list : lists_) move(list);
  for (List& list : sources_) move(list);
  blocks_ = std::move(packed);
}

}  // namespace hulld
