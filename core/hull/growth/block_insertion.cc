#include "core/hull/growth/block_insertion.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "core/hull/growth/conflict_lists.h"

namespace hulld {
namespace {

// From so many points and triangles on, zones for threads are worth making.
constexpr size_t kWorthZones = 1024;
// Points of the first round, about.
constexpr size_t kFirstRound = 64;
// Insertions between two polls of should_stop.
constexpr size_t kPointsPerPoll = 256;

// Odd, and far from any power of two: consecutive numbers get ranks far apart.
constexpr uint32_t kMultiplier = 0x9E3779B1u;

// The inverse of an odd number modulo 2^32, by Newton's iteration: each step doubles the number of
// right bits.
constexpr uint32_t InverseOf(uint32_t odd) {
  uint32_t x = odd;
  for (int i = 0; i < 5; ++i) x *= 2 - odd * x;
  return x;
}
static_assert(InverseOf(kMultiplier) * kMultiplier == 1);

uint32_t Scramble(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7FEB352Du;
  x ^= x >> 15;
  x *= 0x846CA68Bu;
  return x ^ (x >> 16);
}

// Where to insert a point, for sorting: the place of its direction in the upper half, the point's
// index in the lower.
using SortKey = uint64_t;
// Cells a side, as a power of two, of the grid that tells the place; and the bits of a place: three
// for the face of the cube.
constexpr int kGridBits = 10;
constexpr int kPlaceBits = 3 + 2 * kGridBits;

void SortByUpperHalf(std::vector<SortKey>& keys, std::vector<SortKey>& scratch) {
  constexpr size_t kWorthRadix = 2048;
  if (keys.size() < kWorthRadix) {
    std::sort(keys.begin(), keys.end());
    return;
  }
  constexpr int kDigit = 12;
  scratch.resize(keys.size());
  for (int shift = 32; shift < 32 + kPlaceBits; shift += kDigit) {
    std::array<uint32_t, 1 << kDigit> starts{};
    constexpr uint64_t kMask = (1 << kDigit) - 1;
    for (const SortKey key : keys) ++starts[(key >> shift) & kMask];
    uint32_t sum = 0;
    for (uint32_t& start : starts) {
      const uint32_t count = start;
      start = sum;
      sum += count;
    }
    for (const SortKey key : keys) scratch[starts[(key >> shift) & kMask]++] = key;
    keys.swap(scratch);
  }
}

// The bits of a number below 2^16, each followed by a zero.
uint32_t Spread(uint32_t x) {
  x = (x | (x << 8)) & 0x00FF00FF;
  x = (x | (x << 4)) & 0x0F0F0F0F;
  x = (x | (x << 2)) & 0x33333333;
  return (x | (x << 1)) & 0x55555555;
}

// Directions in Morton order on a fine grid, face by face.
SortKey KeyOf(const DirectionMap& directions, const Vector& point, uint32_t index) {
  const auto cell =
      static_cast<uint32_t>(DirectionMap::PlaceIn(directions.center(), 1 << kGridBits, point).cell);
  constexpr uint32_t kMask = (1u << kGridBits) - 1;
  const uint32_t face = cell >> (2 * kGridBits);
  const uint32_t order = Spread((cell >> kGridBits) & kMask) << 1 | Spread(cell & kMask);
  return static_cast<uint64_t>(face << (2 * kGridBits) | order) << 32 | index;
}

// Adds points in rounds of growing size, each reduced to those that the map of directions cannot
// reject and sorted along the surface.
class RoundsInsertion {
 public:
  RoundsInsertion(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                  int threads, const std::function<bool()>& should_stop)
      : surface_(surface),
        vertices_(vertices),
        points_(points),
        threads_(threads),
        should_stop_(should_stop),
        rounds_(points.size()) {}

  bool Run() {
    for (int round = 0; round < rounds_.count(); ++round) {
      Choose(round);
      if (!InsertChosen()) return false;
    }
    return true;
  }

 private:
  // Fills chosen_ with the round's points that cannot be rejected at once, in the order to insert.
  void Choose(int round) {
    const bool is_last = round + 1 == rounds_.count();
    members_.clear();
    if (!is_last) rounds_.AppendRound(round, members_);
    surface_.MeasureBefore(vertices_, is_last ? points_.size() : members_.size());
    const DirectionMap* directions = surface_.directions();
    if (is_last) ChooseLast(round, directions);
    chosen_.clear();
    if (directions == nullptr) {
      for (const uint32_t i : members_) chosen_.push_back(points_[i]);
      return;
    }
    keys_.clear();
    for (const uint32_t i : members_) {
      if (!directions->IsCertainlyInside(directions->PlaceOf(points_[i]))) {
        keys_.push_back(KeyOf(*directions, points_[i], i));
      }
    }
    if (!is_last) surface_.CountRejected(members_.size(), members_.size() - keys_.size());
    SortByUpperHalf(keys_, scratch_);
    // Gathered first: the misses of a loop that does nothing else overlap.
    for (const SortKey key : keys_) chosen_.push_back(points_[static_cast<uint32_t>(key)]);
  }

  // The last round is most of the points: all are read in order, and only those that remain are
  // asked whether they belong to it.
  void ChooseLast(int round, const DirectionMap* directions) {
    if (directions == nullptr) {
      members_.resize(points_.size());
      std::iota(members_.begin(), members_.end(), 0u);
    } else {
      directions->AppendSurvivors(points_, members_);
    }
    std::erase_if(members_, [&](uint32_t i) { return rounds_.RoundOf(i) != round; });
  }

  bool InsertChosen() {
    if (threads_ > 1 && surface_.directions() != nullptr && chosen_.size() >= kWorthZones &&
        surface_.triangle_count() >= kWorthZones) {
      std::optional<std::vector<Vector>> put_off =
          surface_.InsertInZones(vertices_, chosen_, threads_ < 4 ? 2 : 4, should_stop_);
      if (!put_off) return false;
      chosen_ = std::move(*put_off);
    }
    for (size_t k = 0; k < chosen_.size(); ++k) {
      if (k % kPointsPerPoll == 0 && should_stop_ && should_stop_()) return false;
      surface_.Insert(vertices_, chosen_[k]);
    }
    return true;
  }

  Surface& surface_;
  VertexTable& vertices_;
  std::span<const Vector> points_;
  int threads_;
  const std::function<bool()>& should_stop_;
  InsertionRounds rounds_;
  std::vector<uint32_t> members_;
  std::vector<SortKey> keys_;
  std::vector<SortKey> scratch_;
  std::vector<Vector> chosen_;
};

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
// From this many runs on, threads save more than they cost.
constexpr size_t kWorthThreads = 512;

// One call of InsertBlock.
//
// Idea: of most clouds most points are inside. Samples of growing size shape the surface; then the
// map of directions rejects most of what follows, read once and in order, and what remains goes
// into conflict lists. A block most of which is outside is inserted in rounds instead.
class BlockInsertion {
 public:
  BlockInsertion(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, int threads,
                 const std::function<bool()>& should_stop)
      : surface_(surface),
        vertices_(vertices),
        points_(points),
        done_(done.begin(), done.end()),
        threads_(std::max(threads, 1)),
        should_stop_(should_stop) {}

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
    const ConflictLists::Outcome outcome = lists.InsertAll(should_stop_);
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

  // What a part of a sample comes to that the surface does not change under.
  struct Part {
    // Points that see a triangle, and these.
    std::vector<Vector> outside;
    std::vector<TriangleId> seen;
    std::vector<VertexId> duplicates;
    std::vector<Vector> astray;
    size_t asked = 0;
    size_t rejected = 0;
  };

  // The runs are dealt out to threads in order, so that the result is the same on any number.
  void TakeByDirection(size_t stride, ConflictLists& lists) {
    surface_.MeasureBefore(vertices_, points_.size() / stride);
    const std::vector<size_t> runs = RunsOf(stride);
    const size_t part_count = runs.size() < kWorthThreads ? 1 : static_cast<size_t>(threads_);
    std::vector<Part> parts(part_count);
#pragma omp parallel for num_threads(part_count) schedule(static, 1) if (part_count > 1)
    for (size_t k = 0; k < parts.size(); ++k) {
      const size_t first = runs.size() * k / parts.size();
      const size_t end = runs.size() * (k + 1) / parts.size();
      parts[k] = Locate(std::span(runs).subspan(first, end - first));
    }
    for (size_t k = 1; k < parts.size(); ++k) {
      Append(parts[k].outside, parts[0].outside);
      Append(parts[k].seen, parts[0].seen);
    }
    for (const Part& part : parts) {
      for (const VertexId v : part.duplicates) vertices_.CountDuplicate(v);
      Append(part.astray, astray_);
      surface_.CountRejected(part.asked, part.rejected);
    }
    lists.Take(parts[0].outside, parts[0].seen);
  }

  template <typename T>
  static void Append(const std::vector<T>& what, std::vector<T>& to) {
    to.insert(to.end(), what.begin(), what.end());
  }

  Part Locate(std::span<const size_t> runs) const {
    const DirectionMap& directions = *surface_.directions();
    Part part;
    std::vector<Vector> survivors;
    std::vector<uint32_t> of_run;
    for (const size_t first : runs) {
      const std::span<const Vector> run = points_.subspan(first, RunSize(first));
      of_run.clear();
      directions.AppendSurvivors(run, of_run);
      // Gathered while they are in the cache.
      for (const uint32_t i : of_run) {
        if (!IsDone(first + i)) survivors.push_back(run[i]);
      }
      part.asked += run.size();
    }
    part.rejected = part.asked - survivors.size();
    for (const Vector& p : survivors) LocateSurvivor(directions, p, part);
    return part;
  }

  void LocateSurvivor(const DirectionMap& directions, const Vector& p, Part& part) const {
    const std::optional<Surface::Location> location =
        surface_.Locate(vertices_, p, directions.hint(directions.PlaceOf(p).cell));
    if (!location) {
      part.astray.push_back(p);
    } else if (location->side == Surface::Side::kOutside) {
      part.outside.push_back(p);
      part.seen.push_back(location->triangle);
    } else if (const auto corner = surface_.CornerAt(vertices_, location->triangle, p)) {
      part.duplicates.push_back(*corner);
    }
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
    return RoundsInsertion(surface_, vertices_, rest_, threads_, should_stop_).Run();
  }

  Surface& surface_;
  VertexTable& vertices_;
  std::span<const Vector> points_;
  // Indices of points that are not to be inserted, few.
  std::vector<uint32_t> done_;
  int threads_;
  const std::function<bool()>& should_stop_;
  // The stride of the sample before; 0 when there is none.
  size_t stride_before_ = 0;
  // Points that are to be inserted one by one: the walk to them was too long.
  std::vector<Vector> astray_;
  // Points that are to be inserted in rounds.
  std::vector<Vector> rest_;
};

}  // namespace

InsertionRounds::InsertionRounds(size_t n) : n_(static_cast<uint32_t>(n)), count_(1) {
  while ((kFirstRound << (2 * (count_ - 1))) < n && count_ < 16) ++count_;
  group_mask_ = (1u << (2 * (count_ - 1))) - 1;
}

int InsertionRounds::RoundOf(uint32_t i) const {
  const uint32_t rank = (i * kMultiplier + Scramble(i & ~group_mask_)) & group_mask_;
  return (std::bit_width(rank) + 1) / 2;
}

void InsertionRounds::AppendRound(int round, std::vector<uint32_t>& members) const {
  for (uint64_t group = 0; group < n_; group += uint64_t{group_mask_} + 1) {
    const auto first = static_cast<uint32_t>(group);
    const uint32_t shift = Scramble(first);
    for (uint32_t rank = FirstRank(round); rank < FirstRank(round + 1); ++rank) {
      const uint32_t low = (rank - shift) * InverseOf(kMultiplier);
      const uint32_t i = first | (low & group_mask_);
      if (i < n_) members.push_back(i);
    }
  }
}

bool InsertBlock(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                 std::span<const uint32_t> done, int threads,
                 const std::function<bool()>& should_stop) {
  return BlockInsertion(surface, vertices, points, done, threads, should_stop).Run();
}

}  // namespace hulld
