#include "core/hull/growth/block_insertion.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/hull/growth/conflict_lists.h"
#include "core/hull/growth/insertion_rounds.h"

namespace hulld {
namespace {

// The smaller a surface, the cheaper it is to test a point against all its triangles.
constexpr size_t kMostTrianglesToTest = 64;
// A block of at most this many points is not worth a map of directions for rejecting most of them.
constexpr size_t kSmallBlock = 65536;
// Points of the first of the samples of a larger block, at most.
constexpr size_t kLargestFirstSample = 16384;
// Each sample, and then the block, is this many times the sample before.
constexpr size_t kSampleRatio = 16;
// Samples are made of runs of consecutive points, for the sake of memory.
constexpr size_t kRun = 64;

// One call of InsertBlock.
//
// Idea: of most clouds most points are inside. Samples of growing size shape the surface; then the
// map of directions rejects most of what follows, read once and in order, and what remains goes
// into conflict lists. A block most of which is outside is inserted in rounds instead.
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
    // A triangle's list takes memory whether it is used or not.
    if (!surface_.IsMeasurable() || 64 * points_.size() < surface_.triangle_count()) {
      return InsertRounds(0);
    }
    for (size_t stride = FirstStride(); stride > 0; stride /= kSampleRatio) {
      const ConflictLists::Outcome outcome = InsertSample(stride);
      if (outcome == ConflictLists::Outcome::kStopped) return false;
      if (outcome == ConflictLists::Outcome::kGaveUp) return InsertRounds(stride);
      stride_before_ = stride;
    }
    return true;
  }

 private:
  // Where the runs of a sample begin: each stride-th of the block, without those of earlier
  // samples.
  std::vector<size_t> RunsOf(size_t stride) const {
    std::vector<size_t> runs;
    for (size_t first = 0; first < points_.size(); first += kRun * stride) {
      if (stride_before_ == 0 || first / kRun % stride_before_ != 0) runs.push_back(first);
    }
    return runs;
  }
  size_t RunSize(size_t first) const { return std::min(kRun, points_.size() - first); }

  // A power of kSampleRatio, or 1 for all points at once.
  size_t FirstStride() const {
    if (points_.size() <= kSmallBlock) return 1;
    size_t stride = 1;
    while (points_.size() / stride > kLargestFirstSample) stride *= kSampleRatio;
    return stride;
  }

  ConflictLists::Outcome InsertSample(size_t stride) {
    ConflictLists lists(surface_, vertices_);
    if (surface_.triangle_count() <= kMostTrianglesToTest) {
      lists.Take(Sample(stride));
    } else {
      TakeByDirection(stride, lists);
    }
    const ConflictLists::Outcome outcome = lists.InsertAll(poll_);
    if (outcome == ConflictLists::Outcome::kStopped) return outcome;
    if (outcome == ConflictLists::Outcome::kGaveUp) rest_ = lists.TakeRest();
    for (const Vector& p : astray_) surface_.Insert(vertices_, p);
    astray_.clear();
    surface_.FinishInsertions(vertices_);
    return outcome;
  }

  bool IsDone(size_t i) const {
    return std::find(done_.begin(), done_.end(), static_cast<uint32_t>(i)) != done_.end();
  }

  std::vector<Vector> Sample(size_t stride) const {
    std::vector<Vector> sample;
    sample.reserve(points_.size() / stride + kRun);
    for (const size_t first : RunsOf(stride)) {
      for (size_t i = first; i < first + RunSize(first); ++i) {
        if (!IsDone(i)) sample.push_back(points_[i]);
      }
    }
    return sample;
  }

  // Looks up where each point of the sample lies and gives the lists those outside.
  void TakeByDirection(size_t stride, ConflictLists& lists) {
    surface_.MeasureBefore(vertices_, points_.size() / stride);
    const DirectionMap& directions = *surface_.directions();
    const std::vector<Vector> survivors = SurvivorsOf(stride, directions);
    std::vector<Vector> outside;
    std::vector<TriangleId> seen;
    for (const Vector& p : survivors) {
      const std::optional<Surface::Location> location =
          surface_.Locate(vertices_, p, directions.hint(directions.PlaceOf(p).cell));
      if (!location) {
        astray_.push_back(p);
      } else if (location->side == Surface::Side::kOutside) {
        outside.push_back(p);
        seen.push_back(location->triangle);
      } else if (const auto corner = surface_.CornerAt(vertices_, location->triangle, p)) {
        vertices_.CountDuplicate(*corner);
      }
    }
    lists.Take(outside, seen);
  }

  // The points of a sample that the map of directions cannot reject.
  std::vector<Vector> SurvivorsOf(size_t stride, const DirectionMap& directions) {
    std::vector<Vector> survivors;
    std::vector<uint32_t> of_run;
    size_t asked = 0;
    for (const size_t first : RunsOf(stride)) {
      const std::span<const Vector> run = points_.subspan(first, RunSize(first));
      of_run.clear();
      directions.AppendSurvivors(run, of_run);
      // Gathered while they are in the cache.
      for (const uint32_t i : of_run) {
        if (!IsDone(first + i)) survivors.push_back(run[i]);
      }
      asked += run.size();
    }
    surface_.CountRejected(asked, asked - survivors.size());
    return survivors;
  }

  // Inserts in rounds what conflict lists gave up and what no sample up to this stride had; all,
  // for stride 0.
  bool InsertRounds(size_t stride) {
    rest_.reserve(points_.size());
    for (size_t first = 0; first < points_.size(); first += kRun) {
      if (stride > 0 && first / kRun % stride == 0) continue;
      const size_t end = std::min(first + kRun, points_.size());
      for (size_t i = first; i < end; ++i) {
        if (!IsDone(i)) rest_.push_back(points_[i]);
      }
    }
    return InsertInRounds(surface_, vertices_, rest_, poll_);
  }

  Surface& surface_;
  VertexTable& vertices_;
  std::span<const Vector> points_;
  // Indices of points that are not to be inserted, few.
  std::vector<uint32_t> done_;
  StopPoll& poll_;
  // The stride of the sample before; 0 when there is none.
  size_t stride_before_ = 0;
  // Points that are to be inserted one by one: the walk to them was too long.
  std::vector<Vector> astray_;
  // Points that are to be inserted in rounds.
  std::vector<Vector> rest_;
};

}  // namespace

bool InsertBlock(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, StopPoll& poll) {
  return BlockInsertion(surface, vertices, points, done, poll).Run();
}

}  // namespace hulld
