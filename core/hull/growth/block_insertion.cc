#include "core/hull/growth/block_insertion.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <vector>

#include "core/hull/growth/conflict_lists.h"
#include "core/hull/growth/insertion_rounds.h"
#include "core/hull/surface/triangle_cones.h"

namespace hulld {
namespace {

// On a surface this small, testing a point against all triangles is cheap.
constexpr size_t kMaxTrianglesToTest = 64;
// A block of at most this many points is not sampled: all are tested against all triangles.
constexpr size_t kSmallBlock = 8192;
// A block, or a sample, of more than kMinPointsToProbe points is sampled even so if nearly all of
// them are outside, as on a sphere, because assigning them to conflict lists would be wasted work.
// They count as nearly all outside if fewer than kFewInside of kProbes points are inside the first
// surface, usually an octahedron. **Observed** share inside: none on a sphere, 2 % to 5 % in scans
// of nearly convex objects, 15 % to 57 % in other meshes and clouds.
constexpr size_t kMinPointsToProbe = 1024;
constexpr size_t kProbes = 256;
constexpr size_t kFewInside = 4;
// Each sample, and finally the block, is this many times as large as the previous sample.
constexpr size_t kSampleRatio = 16;
// Samples consist of runs of consecutive points, for memory locality.
constexpr size_t kRun = 8;
// Parameters of the map of directions (see Surface::MeasureBefore) in which a sample is looked up,
// and of the finer map that follows if the first leaves many times as many points as the surface
// has triangles, as for points along large facets.
constexpr double kBlockMapFineness = 2.4;
constexpr double kBlockWalksPerPoint = 0.2;
constexpr size_t kManyPerTriangle = 32;
constexpr double kFineMapFineness = 8;
constexpr double kWalksPerSurvivor = 0.6;
// The number of points to locate per triangle at which computing the cones of the triangles pays
// off. Observed: with 12 points per triangle, cones cost 3 % of the time of a block; with 20, they
// save 4 %.
constexpr size_t kWorthCones = 16;

// Share of duplicates in a sample above which the rest of the block is inserted in rounds, whose
// order places neighbors close in memory.
constexpr double kMaxDuplicates = 0.875;

// One call of InsertBlock.
//
// In most clouds, most points are inside. Samples of growing size shape the surface; then the map
// of directions, reading the rest once and in order, rejects most of it, and the remaining points
// go into conflict lists. A block with most points outside is inserted in rounds instead.
class BlockInsertion {
 public:
  BlockInsertion(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, StopPoll& poll)
      : surface_(surface),
        vertices_(vertices),
        points_(points),
        done_(done.begin(), done.end()),
        poll_(poll) {}

  bool Run() {
    // Measuring a triangle and allocating its list cost about as much as inserting a point in
    // rounds.
    if (!surface_.IsMeasurable() || points_.size() < surface_.triangle_count()) {
      return InsertRounds();
    }
    for (size_t stride = FirstStride(); stride > 0; stride /= kSampleRatio) {
      const ConflictLists::Outcome outcome = InsertSample(stride);
      stride_before_ = stride;
      if (outcome == ConflictLists::Outcome::kStopped) return false;
      if (outcome == ConflictLists::Outcome::kGaveUp) return InsertRounds();
    }
    return true;
  }

 private:
  // A range of the block.
  struct Range {
    size_t first;
    size_t end;
  };
  // Returns a sample in order: each stride-th run of the block, without the runs of earlier
  // samples.
  std::vector<Range> RangesOf(size_t stride) const {
    // Strides are powers of two, so no division is needed. **Observed** for a million points in a
    // ball or a cube: it took 4 to 9 % of the time.
    static_assert(std::has_single_bit(kSampleRatio));
    const size_t done_mask = stride_before_ / stride - 1;
    std::vector<Range> ranges;
    size_t run = 0;
    for (size_t first = 0; first < points_.size(); first += kRun * stride, ++run) {
      if (stride_before_ != 0 && (run & done_mask) == 0) continue;
      const size_t end = std::min(first + kRun, points_.size());
      if (!ranges.empty() && ranges.back().end == first) {
        ranges.back().end = end;
      } else {
        ranges.push_back({first, end});
      }
    }
    return ranges;
  }

  // Returns a power of kSampleRatio, or 1 for all points together.
  size_t FirstStride() const {
    size_t stride = 1;
    while (points_.size() / stride > kSmallBlock) stride *= kSampleRatio;
    if (points_.size() / stride > kMinPointsToProbe && AreNearlyAllOutside()) {
      stride *= kSampleRatio;
    }
    return stride;
  }

  // Returns true if nearly all points are outside, judged by kProbes points spread over the block.
  // Returns false if the surface has too many triangles to test.
  bool AreNearlyAllOutside() const {
    if (surface_.triangle_count() > kMaxTrianglesToTest) return false;
    size_t inside = 0;
    for (size_t k = 0; k < kProbes && inside < kFewInside; ++k) {
      const Vector& p = points_[k * points_.size() / kProbes];
      bool is_seen = false;
      surface_.ForEachTriangle([&](TriangleId id, const SurfaceTriangle&) {
        is_seen = is_seen || surface_.IsCertainlySeenFrom(vertices_, id, p);
      });
      if (!is_seen) ++inside;
    }
    return inside < kFewInside;
  }

  ConflictLists::Outcome InsertSample(size_t stride) {
    surface_.BeginInsertions(vertices_);
    ConflictLists lists(surface_, vertices_, poll_);
    if (surface_.triangle_count() <= kMaxTrianglesToTest) {
      lists.Take(Sample(stride));
    } else if (!TakeByDirection(stride, lists)) {
      return ConflictLists::Outcome::kGaveUp;
    }
    const ConflictLists::Outcome outcome = lists.InsertAll();
    if (outcome == ConflictLists::Outcome::kStopped) return outcome;
    if (outcome == ConflictLists::Outcome::kGaveUp) rest_ = lists.TakeRest();
    for (const Vector& p : astray_) {
      if (poll_.Step(1 + surface_.TakeSteps())) return ConflictLists::Outcome::kStopped;
      surface_.Insert(vertices_, p);
    }
    astray_.clear();
    surface_.FinishInsertions(vertices_);
    return outcome;
  }

  bool IsDone(size_t i) const {
    return std::find(done_.begin(), done_.end(), static_cast<uint32_t>(i)) != done_.end();
  }

  std::vector<Vector> Sample(size_t stride) const {
    std::vector<Vector> sample;
    AppendSample(stride, sample);
    return sample;
  }
  void AppendSample(size_t stride, std::vector<Vector>& sample) const {
    sample.reserve(sample.size() + points_.size() / stride + kRun);
    const auto append = [&](size_t first, size_t end) {
      sample.insert(sample.end(), points_.begin() + static_cast<ptrdiff_t>(first),
                    points_.begin() + static_cast<ptrdiff_t>(end));
    };
    for (auto [first, end] : RangesOf(stride)) {
      for (const uint32_t i : done_) {
        if (i < first || i >= end) continue;
        append(first, i);
        first = i + size_t{1};
      }
      append(first, end);
    }
  }

  // Adds the points of the sample that are outside to the lists. Returns false, and adds none, if
  // most of the sample are duplicates.
  bool TakeByDirection(size_t stride, ConflictLists& lists) {
    std::vector<Vector> outside;
    std::vector<TriangleId> seen;
    const size_t duplicates = LocateSample(stride, outside, seen);
    if (poll_.stopped()) return true;
    if (static_cast<double>(duplicates) > kMaxDuplicates * static_cast<double>(tested_)) {
      rest_ = std::move(outside);
      rest_.insert(rest_.end(), astray_.begin(), astray_.end());
      return false;
    }
    lists.Take(outside, seen, tested_);
    return true;
  }

  // Appends the points of the sample that are outside, each with a triangle that it sees. Counts
  // and returns the number of duplicates. If the poll stops, some points are skipped.
  size_t LocateSample(size_t stride, std::vector<Vector>& outside, std::vector<TriangleId>& seen) {
    size_t duplicates = 0;
    TriangleCones cones(surface_.id_bound());
    const std::vector<Vector> survivors = SurvivorsOf(stride, cones);
    TriangleCones* const worthwhile =
        survivors.size() > kWorthCones * surface_.triangle_count() ? &cones : nullptr;
    for (const Vector& p : survivors) {
      if (poll_.Step()) break;
      // Consecutive points are often close to each other.
      if (!seen.empty() && surface_.IsCertainlySeenFrom(vertices_, seen.back(), p)) {
        outside.push_back(p);
        seen.push_back(seen.back());
        continue;
      }
      const Surface::Location location = surface_.Locate(vertices_, p, worthwhile);
      if (location.side == Surface::Side::kUnknown) {
        astray_.push_back(p);
      } else if (location.side == Surface::Side::kOutside) {
        outside.push_back(p);
        seen.push_back(location.triangle);
      } else if (location.side == Surface::Side::kInside) {
        if (const auto corner = surface_.CornerAt(vertices_, location.triangle, p)) {
          vertices_.CountDuplicate(*corner);
          ++duplicates;
        }
      }
    }
    return duplicates;
  }

  // Returns the points of a sample that neither the map of directions nor, if many remain, a finer
  // map can reject.
  std::vector<Vector> SurvivorsOf(size_t stride, TriangleCones& cones) {
    surface_.MeasureBefore(vertices_, points_.size() / stride,
                           needs_fine_map_ ? kFineMapFineness : kBlockMapFineness,
                           kBlockWalksPerPoint, poll_, needs_fine_map_ ? &cones : nullptr);
    std::vector<Vector> survivors;
    tested_ = 0;
    for (const Range& range : RangesOf(stride)) {
      const std::span<const Vector> points = points_.subspan(range.first, range.end - range.first);
      indices_.clear();
      surface_.directions()->AppendSurvivors(points, indices_, poll_);
      // Gathered while the points are in the cache.
      for (const uint32_t i : indices_) {
        if (!IsDone(range.first + i)) survivors.push_back(points[i]);
      }
      tested_ += points.size();
    }
    surface_.CountRejected(tested_, tested_ - survivors.size());
    needs_fine_map_ = survivors.size() > kManyPerTriangle * surface_.triangle_count();
    if (needs_fine_map_ && surface_.MeasureBefore(vertices_, survivors.size(), kFineMapFineness,
                                                  kWalksPerSurvivor, poll_, &cones)) {
      indices_.clear();
      surface_.directions()->AppendSurvivors(survivors, indices_, poll_);
      for (size_t k = 0; k < indices_.size(); ++k) survivors[k] = survivors[indices_[k]];
      survivors.resize(indices_.size());
    }
    return survivors;
  }

  // Inserts, in rounds, the points that the conflict lists abandoned and the points that were in no
  // sample.
  bool InsertRounds() {
    surface_.BeginInsertions(vertices_);
    if (stride_before_ != 1) AppendSample(1, rest_);
    return InsertInRounds(surface_, vertices_, rest_, poll_);
  }

  Surface& surface_;
  VertexTable& vertices_;
  std::span<const Vector> points_;
  // Indices of the few points to skip.
  std::vector<uint32_t> done_;
  StopPoll& poll_;
  // The stride of the previous sample; 0 if there is none.
  size_t stride_before_ = 0;
  // Points to insert one by one, because the walk to them was too long.
  std::vector<Vector> astray_;
  // Points to insert in rounds.
  std::vector<Vector> rest_;
  // Number of points of the sample that were looked up in the map.
  size_t tested_ = 0;
  // True if the last sample left many points for each triangle.
  bool needs_fine_map_ = false;
  // Surviving indices among the points being looked up in the map.
  std::vector<uint32_t> indices_;
};

}  // namespace

bool InsertBlock(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, StopPoll& poll) {
  return BlockInsertion(surface, vertices, points, done, poll).Run();
}

}  // namespace hulld
