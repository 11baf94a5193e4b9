#include "core/query/placed/support_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/base/stop_poll.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/simd_path.h"
#include "core/query/placed/lanes.h"

namespace hulld {
namespace {

// Sets of up to this many points are scanned: ten blocks of four. Not tuned.
constexpr size_t kMaxScanned = 40;
// Cells of the cube map per point. A choice: with two, of 16 bytes each, most cells list at most
// four points.
constexpr double kCellsPerPoint = 2;
// Cells with more points than this are divided.
constexpr size_t kMaxListed = 12;
// Lists of at most this many points are compared pairwise.
constexpr size_t kMaxCompared = 16;
// Minimum width of a cell; far wider than kCellMargin. Observed: points this close to a common
// plane come from rounding, and a list of them is as good as a finer division.
constexpr double kMinWidth = 0x1p-22;
// Cells per point beyond which no further cell is divided.
constexpr size_t kMaxCellsPerPoint = 8;
// Limit on the estimated number of times that each point is listed in the parts of the enclosing
// squares. Beyond it, a square with more points than kMaxCompared gets no list. Observed: 8 on
// average for points all over a surface. The bound is for points along curves, where the number
// doubles with every second division of a square.
constexpr double kMaxCopies = 64;
// Sets of up to this many points get only lists. A tree would save nothing for them, because the
// number of copies grows with the square root of the number of points.
constexpr size_t kMaxPointsWithoutTree = 4096;
// Fraction of candidates among all points beyond which scanning all is faster than sorting the
// candidates.
constexpr size_t kPointsPerCandidate = 16;
// Sets with coordinates beyond these limits are scanned: products might overflow or underflow
// significantly.
constexpr double kLargestCoordinate = 0x1p900;
constexpr double kMinExtent = 0x1p-800;

[[gnu::always_inline]] inline void Absolute(Lanes& lanes) {
  lanes = lanes > -lanes ? lanes : -lanes;
}

// Returns powers of two that make the extents of the points roughly equal: the size along each
// axis relative to the largest, at least 2^-10.
Vector ScaleOf(const Vector& extents) {
  constexpr int kMin = -10;
  int exponents[3];
  for (int i = 0; i < 3; ++i) {
    exponents[i] = extents[i] > 0 ? std::ilogb(extents[i]) : kMin - 2000;
  }
  const int largest = *std::max_element(exponents, exponents + 3);
  Vector scale;
  for (int i = 0; i < 3; ++i) scale[i] = std::ldexp(1.0, std::max(exponents[i] - largest, kMin));
  return scale;
}

// Points as seen on a face of the cube: along direction (s, t) the value is s a + t b + c.
struct FacePoints {
  std::vector<double> a;
  std::vector<double> b;
  std::vector<double> c;
  std::vector<uint32_t> ids;
  // The arrays are padded to a multiple of four by repeating the last point.
  size_t size = 0;

  void Reserve(size_t n) {
    if (a.size() >= n + 4) return;
    a.resize(n + 4);
    b.resize(n + 4);
    c.resize(n + 4);
    ids.resize(n + 4);
  }
  void CopyFrom(const FacePoints& from) {
    Reserve(from.size);
    size = from.size;
    std::copy_n(from.a.begin(), size, a.begin());
    std::copy_n(from.b.begin(), size, b.begin());
    std::copy_n(from.c.begin(), size, c.begin());
    std::copy_n(from.ids.begin(), size, ids.begin());
    Pad();
  }
  void Pad() {
    for (size_t i = size; i % 4 != 0; ++i) {
      a[i] = a[size - 1];
      b[i] = b[size - 1];
      c[i] = c[size - 1];
      ids[i] = ids[size - 1];
    }
  }
};

// A widened square on a face.
struct Square {
  double s;
  double t;
  double half_s;
  double half_t;
};

// Returns the largest lead of p over q at any of the square's corners, up to rounding.
[[gnu::always_inline]] inline double LeadOf(const FacePoints& points, size_t p, size_t q,
                                            const Square& square) {
  const double a = points.a[p] - points.a[q];
  const double b = points.b[p] - points.b[q];
  const double c = points.c[p] - points.c[q];
  return (c + (square.s * a + square.t * b)) +
         (square.half_s * std::abs(a) + square.half_t * std::abs(b));
}

// The direction (s, t) at the middle of a square, broadcast to all lanes.
struct Middle {
  [[gnu::always_inline]] explicit Middle(const Square& square) {
    Broadcast(square.s, s);
    Broadcast(square.t, t);
  }
  [[gnu::always_inline]] void Evaluate(const FacePoints& points, size_t i, Lanes& values) const {
    Lanes a, b, c;
    Load(&points.a[i], a);
    Load(&points.b[i], b);
    Load(&points.c[i], c);
    values = c + (s * a + t * b);
  }
  Lanes s;
  Lanes t;
};

// Returns the first of the points that are farthest along the middle.
[[gnu::always_inline]] inline size_t FarthestAlong(const Middle& middle, const FacePoints& points) {
  Lanes best, values;
  Broadcast(-INFINITY, best);
  for (size_t i = 0; i < points.size; i += 4) {
    middle.Evaluate(points, i, values);
    best = values > best ? values : best;
  }
  const double largest = std::max(std::max(best[0], best[1]), std::max(best[2], best[3]));
  Lanes wanted;
  Broadcast(largest, wanted);
  for (size_t i = 0; i < points.size; i += 4) {
    middle.Evaluate(points, i, values);
    const auto same = values >= wanted;
    if ((same[0] | same[1] | same[2] | same[3]) != 0) {
      return i + (same[0] != 0 ? 0 : same[1] != 0 ? 1 : same[2] != 0 ? 2 : 3);
    }
  }
  return 0;
}

// Keeps the points of `from` that may be farthest along a direction in the square. `bound`: error
// bound of a lead.
[[gnu::always_inline]] inline void FilterWith(const FacePoints& from, const Square& square,
                                              double bound, FacePoints& to) {
  const Middle middle(square);
  const size_t q = FarthestAlong(middle, from);
  Lanes half_s, half_t, least, q_a, q_b, q_c;
  Broadcast(square.half_s, half_s);
  Broadcast(square.half_t, half_t);
  Broadcast(-bound, least);
  Broadcast(from.a[q], q_a);
  Broadcast(from.b[q], q_b);
  Broadcast(from.c[q], q_c);
  to.Reserve(from.size);
  size_t size = 0;
  for (size_t i = 0; i < from.size; i += 4) {
    Lanes a, b, c;
    Load(&from.a[i], a);
    Load(&from.b[i], b);
    Load(&from.c[i], c);
    a -= q_a;
    b -= q_b;
    c -= q_c;
    Lanes size_a = a;
    Lanes size_b = b;
    Absolute(size_a);
    Absolute(size_b);
    const Lanes lead = (c + (middle.s * a + middle.t * b)) + (half_s * size_a + half_t * size_b);
    const auto keep = lead > least;
    if ((keep[0] | keep[1] | keep[2] | keep[3]) == 0) continue;
    for (size_t k = i; k < i + 4; ++k) {
      to.a[size] = from.a[k];
      to.b[size] = from.b[k];
      to.c[size] = from.c[k];
      to.ids[size] = from.ids[k];
      size += static_cast<size_t>(keep[k - i] & 1) & static_cast<size_t>(k < from.size);
    }
  }
  to.size = size;
  to.Pad();
}

void FilterPortably(const FacePoints& from, const Square& square, double bound, FacePoints& to) {
  FilterWith(from, square, bound, to);
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"))) void FilterAvx2(const FacePoints& from, const Square& square,
                                                double bound, FacePoints& to) {
  FilterWith(from, square, bound, to);
}
#else
void FilterAvx2(const FacePoints& from, const Square& square, double bound, FacePoints& to) {
  FilterPortably(from, square, bound, to);
}
#endif

void Filter(const FacePoints& from, const Square& square, double bound, FacePoints& to) {
  UsesAvx2() ? FilterAvx2(from, square, bound, to) : FilterPortably(from, square, bound, to);
}

}  // namespace

// Fills the cells of a map.
class SupportMap::Filling {
 public:
  Filling(SupportMap& map, StopPoll& poll)
      : map_(map), poll_(poll), may_need_tree_(map.points_.size() > kMaxPointsWithoutTree) {}

  // `bound`: see Filter. The cells are incomplete if stopped.
  void Fill(double bound) {
    bound_ = bound;
    max_cells_ = map_.cells_.size() + kMaxCellsPerPoint * map_.points_.size();
    const uint32_t side = map_.side_;
    for (uint32_t face = 0; face < 6 && !poll_.stopped(); ++face) {
      SeeFrom(face);
      FillRange(seen_, {face * side * side, side, -1, -1, 2.0 / side}, {0, side, 0, side}, 0, 1);
    }
  }

  // True if some cell has no list.
  bool needs_tree() const { return needs_tree_; }

 private:
  // A grid of `side` by `side` cells, of a given width on the face, from a corner on.
  struct Grid {
    uint32_t first;
    uint32_t side;
    double s;
    double t;
    double width;
  };
  struct Range {
    uint32_t i_begin;
    uint32_t i_end;
    uint32_t j_begin;
    uint32_t j_end;
  };

  // Projects all points onto a face.
  void SeeFrom(uint32_t face) {
    const uint32_t axis = face / 2;
    const uint32_t first = kCubeAxisAfter[axis];
    const uint32_t second = kCubeAxisAfter[axis + 1];
    const double sign = face % 2 == 0 ? 1 : -1;
    // Coordinates are divided by powers of two, so a direction is multiplied by them.
    const Vector scale = map_.scale_;
    const Vector per_scale = scale.cwiseInverse();
    seen_.Reserve(map_.points_.size());
    seen_.size = map_.points_.size();
    for (size_t i = 0; i < seen_.size; ++i) {
      const Vector& p = map_.points_[i];
      seen_.a[i] = p[first] * per_scale[first];
      seen_.b[i] = p[second] * per_scale[second];
      seen_.c[i] = sign * p[axis] * per_scale[axis];
      seen_.ids[i] = static_cast<uint32_t>(i);
    }
    seen_.Pad();
  }

  static Square Widened(const Grid& grid, const Range& range) {
    // Twice the margin: the excess covers the rounding of this computation.
    const double half_s = 0.5 * grid.width * (range.i_end - range.i_begin);
    const double half_t = 0.5 * grid.width * (range.j_end - range.j_begin);
    return {grid.s + grid.width * range.i_begin + half_s,
            grid.t + grid.width * range.j_begin + half_t, half_s + 2 * kCellMargin,
            half_t + 2 * kCellMargin};
  }

  FacePoints& ListAt(size_t index) {
    while (index >= lists_.size()) lists_.emplace_back(std::make_unique<FacePoints>());
    return *lists_[index];
  }

  // Filters into a list that allocates memory only for the result.
  void FilterInto(const FacePoints& from, const Square& square, FacePoints& to) {
    if (poll_.Step(1 + from.size / kPointsPerStep)) return;
    Filter(from, square, bound_, filtered_);
    to.CopyFrom(filtered_);
  }
  // Frees a long list that is no longer needed. Without this, a set with many points in one cell
  // needs a copy of them for each division.
  static void Release(FacePoints& list) {
    if (list.size > kMaxKept) list = FacePoints();
  }

  // Fills the cells of a range, given a superset of their farthest points.
  void FillRange(const FacePoints& points, const Grid& grid, const Range& range, size_t depth,
                 double copies) {
    FacePoints& found = ListAt(2 * depth);
    FilterInto(points, Widened(grid, range), found);
    FillFiltered(found, grid, range, depth, copies);
  }

  // FillRange for points that have been filtered, which may be released. `copies`: the average
  // number of times that each point is listed in all ranges made by the divisions down to this one.
  void FillFiltered(FacePoints& found, const Grid& grid, const Range& range, size_t depth,
                    double copies) {
    if (poll_.stopped()) return;
    const uint32_t rows = range.i_end - range.i_begin;
    const uint32_t columns = range.j_end - range.j_begin;
    if (found.size <= 4) return FillAll(found, grid, range);
    if (may_need_tree_ && found.size > kMaxCompared && copies > kMaxCopies) {
      LeaveToTree(grid, range);
      return Release(found);
    }
    if (rows == 1 && columns == 1) return FillCell(found, grid, range, depth, copies);
    Range low = range;
    Range high = range;
    if (rows >= columns) {
      low.i_end = high.i_begin = range.i_begin + rows / 2;
    } else {
      low.j_end = high.j_begin = range.j_begin + columns / 2;
    }
    FacePoints& of_low = ListAt(2 * depth + 2);
    FacePoints& of_high = ListAt(2 * depth + 3);
    FilterInto(found, Widened(grid, low), of_low);
    FilterInto(found, Widened(grid, high), of_high);
    copies *= static_cast<double>(of_low.size + of_high.size) / static_cast<double>(found.size);
    Release(found);
    FillFiltered(of_low, grid, low, depth + 1, copies);
    FillFiltered(of_high, grid, high, depth + 1, copies);
  }

  void FillAll(const FacePoints& found, const Grid& grid, const Range& range) {
    Cell cell;
    for (size_t k = 0; k < 4; ++k) cell.ids[k] = found.ids[std::min(k, found.size - 1)];
    for (uint32_t i = range.i_begin; i < range.i_end; ++i) {
      for (uint32_t j = range.j_begin; j < range.j_end; ++j) {
        map_.cells_[grid.first + i * grid.side + j] = cell;
      }
    }
  }

  void LeaveToTree(const Grid& grid, const Range& range) {
    needs_tree_ = true;
    for (uint32_t i = range.i_begin; i < range.i_end; ++i) {
      for (uint32_t j = range.j_begin; j < range.j_end; ++j) {
        map_.cells_[grid.first + i * grid.side + j] = {{0, 0, 0, kNoList}};
      }
    }
  }

  void FillCell(FacePoints& found, const Grid& grid, const Range& range, size_t depth,
                double copies) {
    if (found.size <= kMaxCompared) CompareEach(found, Widened(grid, range));
    if (found.size <= 4) return FillAll(found, grid, range);
    Cell& cell = map_.cells_[grid.first + range.i_begin * grid.side + range.j_begin];
    const bool divides =
        found.size > kMaxListed && grid.width > 2 * kMinWidth && map_.cells_.size() < max_cells_;
    // Beyond this, ids of points, lists and parts would be ambiguous.
    HULLD_CHECK(map_.cells_.size() < kDivided - kLong && map_.lists_.size() < kNoList - kLong);
    if (!divides) {
      const auto others = found.ids.begin() + 3;
      std::copy(found.ids.begin(), others, cell.ids);
      cell.ids[3] = kLong + static_cast<uint32_t>(map_.lists_.size());
      map_.lists_.push_back(static_cast<uint32_t>(found.size - 3));
      map_.lists_.insert(map_.lists_.end(), others, found.ids.begin() + found.size);
      return Release(found);
    }
    const auto first = static_cast<uint32_t>(map_.cells_.size());
    cell.ids[3] = kDivided + first;
    map_.cells_.resize(first + 4);
    const Grid quarters = {first, 2, grid.s + grid.width * range.i_begin,
                           grid.t + grid.width * range.j_begin, 0.5 * grid.width};
    const Range all = {0, 2, 0, 2};
    FacePoints& inner = ListAt(2 * depth + 2);
    FilterInto(found, Widened(quarters, all), inner);
    Release(found);
    FillFiltered(inner, quarters, all, depth + 1, copies);
  }

  // Drops every point that another point leads everywhere on the square.
  void CompareEach(FacePoints& found, const Square& square) const {
    for (size_t p = found.size; p-- > 0;) {
      for (size_t q = 0; q < found.size; ++q) {
        if (p == q || LeadOf(found, p, q, square) > -bound_) continue;
        const size_t last = --found.size;
        // Points before p keep their positions.
        for (size_t k = p; k < last; ++k) {
          found.a[k] = found.a[k + 1];
          found.b[k] = found.b[k + 1];
          found.c[k] = found.c[k + 1];
          found.ids[k] = found.ids[k + 1];
        }
        break;
      }
    }
    found.Pad();
  }

  // Filtering this many points takes about 10 us.
  static constexpr size_t kPointsPerStep = 4096;
  // Lists of at most this many points keep their memory for reuse.
  static constexpr size_t kMaxKept = 4096;

  SupportMap& map_;
  StopPoll& poll_;
  const bool may_need_tree_;
  double bound_ = 0;
  size_t max_cells_ = 0;
  // All points, as seen on the face being filled.
  FacePoints seen_;
  // The result of the last filter.
  FacePoints filtered_;
  // Two for each depth.
  std::vector<std::unique_ptr<FacePoints>> lists_;
  bool needs_tree_ = false;
};

SupportMap SupportMap::ForScanning(std::span<const Vector> points) {
  SupportMap map;
  map.points_ = points;
  return map;
}

SupportMap::SupportMap(std::span<const Vector> points, const std::function<bool()>& should_stop)
    : points_(points) {
  HULLD_CHECK(points_.size() < kLong);
  if (points_.size() <= kMaxScanned) {
    BuildBlocks();
    return;
  }
  Vector low = points_[0];
  Vector high = points_[0];
  for (const Vector& p : points_) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double largest = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  const Vector extents = largest <= kLargestCoordinate ? Vector(high - low) : Vector::Zero();
  if (!(extents.maxCoeff() >= kMinExtent)) {
    BuildBlocks();
    return;
  }
  const Vector scale = ScaleOf(extents);
  scale_ = scale;
  const double cells = kCellsPerPoint * static_cast<double>(points_.size());
  side_ = std::max(2u, static_cast<uint32_t>(std::lround(std::sqrt(cells / 6))));
  half_ = 0.5 * side_;
  below_side_ = std::nextafter(static_cast<double>(side_), 0.0);
  cells_.resize(size_t{6} * side_ * side_);
  StopPoll poll(should_stop);
  Filling filling(*this, poll);
  filling.Fill(kLeadErrorFactor * extents.cwiseQuotient(scale).maxCoeff());
  if (filling.needs_tree() && !poll.stopped()) tree_ = SupportTree(points_, poll);
  stopped_ = poll.stopped();
  cells_.shrink_to_fit();
  lists_.shrink_to_fit();
}

SupportMap::Support SupportMap::Scan(const PlainVector& n) const {
  if (!blocks_.empty()) return FarthestOf(blocks_, points_.size(), n);
  Support best{0, -INFINITY};
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const double value = ValueOf(i, n);
    if (value > best.value) best = {i, value};
  }
  return best;
}

void SupportMap::BuildBlocks() {
  blocks_.resize((points_.size() + 3) / 4);
  for (size_t i = 0; i < 4 * blocks_.size(); ++i) {
    blocks_[i / 4].Set(i % 4, points_[std::min(i, points_.size() - 1)]);
  }
}

// Returns the position of a coordinate within its cell as bits; the first bit selects the half, and
// so on.
uint32_t BitsWithin(double coordinate) {
  return static_cast<uint32_t>((coordinate - std::floor(coordinate)) * 0x1p32);
}

const SupportMap::Cell& SupportMap::QuarterAt(const Cell& divided, const Place& place) const {
  uint32_t s = BitsWithin(place.s);
  uint32_t t = BitsWithin(place.t);
  const Cell* cell = &divided;
  do {
    cell = &cells_[(cell->ids[3] - kDivided) + 2 * (s >> 31) + (t >> 31)];
    s <<= 1;
    t <<= 1;
  } while (cell->ids[3] >= kDivided);
  return *cell;
}

SupportMap::Support SupportMap::LookUpDeep(const Cell& cell, const Place& place,
                                           const PlainVector& n) const {
  const Cell& found = cell.ids[3] >= kDivided ? QuarterAt(cell, place) : cell;
  if (found.ids[3] < kLong) return BestOfFour(found, n);
  if (found.ids[3] == kNoList) return tree_.Farthest(points_, n);
  Support best{found.ids[0], ValueOf(found.ids[0], n)};
  const auto consider = [&](uint32_t id) {
    const double value = ValueOf(id, n);
    best.vertex = value > best.value ? id : best.vertex;
    best.value = std::max(best.value, value);
  };
  consider(found.ids[1]);
  consider(found.ids[2]);
  for (const uint32_t id : RemainingOf(found)) consider(id);
  return best;
}

void SupportMap::AppendCandidates(const PlainVector& n, double error, double least, uint32_t first,
                                  std::vector<uint32_t>& candidates) const {
  const auto begin = static_cast<std::ptrdiff_t>(candidates.size());
  const auto consider = [&](uint32_t id) {
    if (ValueOf(id, n) >= least) candidates.push_back(first + id);
  };
  const double largest = OnCube(n.x * scale_.x, n.y * scale_.y, n.z * scale_.z).largest();
  // A component over the largest moves by less than three times the error over the largest.
  if (scans() || !(4 * error <= kCellMargin * largest)) {
    for (uint32_t i = 0; i < points_.size(); ++i) consider(i);
    return;
  }
  const Place place = PlaceOf(n);
  const Cell& top = CellAt(place);
  const Cell& cell = top.ids[3] >= kDivided ? QuarterAt(top, place) : top;
  if (cell.ids[3] == kNoList) {
    AppendFromTree(n, least, first, candidates);
    return;
  }
  for (const uint32_t id : std::span(cell.ids).first(3)) consider(id);
  if (cell.ids[3] < kLong) {
    consider(cell.ids[3]);
  } else {
    for (const uint32_t id : RemainingOf(cell)) consider(id);
  }
  std::sort(candidates.begin() + begin, candidates.end());
  candidates.erase(std::unique(candidates.begin() + begin, candidates.end()), candidates.end());
}

// Large results come from scanning, which needs no sorting.
void SupportMap::AppendFromTree(const PlainVector& n, double least, uint32_t first,
                                std::vector<uint32_t>& candidates) const {
  const size_t begin = candidates.size();
  const bool are_few = tree_.ForEachAtLeast(points_, n, least, [&](uint32_t id) {
    candidates.push_back(first + id);
    return candidates.size() - begin <= points_.size() / kPointsPerCandidate;
  });
  if (are_few)
    return std::sort(candidates.begin() + static_cast<ptrdiff_t>(begin), candidates.end());
  candidates.resize(begin);
  for (uint32_t i = 0; i < points_.size(); ++i) {
    if (ValueOf(i, n) >= least) candidates.push_back(first + i);
  }
}

std::vector<uint32_t> SupportMap::Listed() const {
  std::vector<char> is_listed(points_.size(), scans() || !tree_.empty());
  for (const Cell& cell : cells_) {
    if (cell.ids[3] >= kNoList) continue;
    for (const uint32_t id : std::span(cell.ids).first(3)) is_listed[id] = 1;
    if (cell.ids[3] < kLong) is_listed[cell.ids[3]] = 1;
  }
  for (size_t at = 0; at < lists_.size(); at += lists_[at] + 1) {
    for (uint32_t k = 1; k <= lists_[at]; ++k) is_listed[lists_[at + k]] = 1;
  }
  std::vector<uint32_t> listed;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    if (is_listed[i]) listed.push_back(i);
  }
  return listed;
}

size_t SupportMap::MemoryBytes() const {
  return blocks_.capacity() * sizeof(SupportBlock) + cells_.capacity() * sizeof(Cell) +
         lists_.capacity() * sizeof(uint32_t) + tree_.MemoryBytes();
}

}  // namespace hulld
