#include "core/hull/surface/direction_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/numeric/error_bounds.h"
#include "core/numeric/exponent_limits.h"
#include "core/numeric/simd_path.h"

#ifdef HULLD_HAS_AVX2_PATH
#include <immintrin.h>
#endif

namespace hulld {

namespace {

// The least pivot of the moments, relative to their sum along the axes: flatter sets have no frame.
constexpr double kMinRelativeMoment = 0x1p-40;
// The condition number of L above which multiplying by L pays off.
constexpr double kWorthAFrame = 4;

double RowSumNorm(const Eigen::Matrix3d& m) { return m.cwiseAbs().rowwise().sum().maxCoeff(); }

}  // namespace

// L is the inverse of the Cholesky factor of the moments.
MapFrame::MapFrame(const Vector& center, const Eigen::Matrix3d& moments) : center_(center) {
  const double trace = moments.trace();
  if (!(trace > 0 && trace <= kLargestDouble)) return;
  const Eigen::Matrix3d c = moments / trace;
  Eigen::Matrix3d factor = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) {
      factor(i, j) = (c(i, j) - factor.row(i).dot(factor.row(j))) / factor(j, j);
    }
    const double pivot = c(i, i) - factor.row(i).squaredNorm();
    if (!(pivot >= kMinRelativeMoment)) return;
    factor(i, i) = std::sqrt(pivot);
    inverse.row(i) = -(factor.row(i).head(i) * inverse.topRows(i)) / factor(i, i);
    inverse(i, i) = 1 / factor(i, i);
  }
  if (RowSumNorm(inverse) * RowSumNorm(factor) < kWorthAFrame) return;
  const Eigen::Matrix3d l = inverse / inverse.cwiseAbs().maxCoeff();
  entries_ = {l(0, 0), l(1, 0), l(1, 1), l(2, 0), l(2, 1), l(2, 2)};
  is_plain_ = false;
}

Eigen::Matrix3d MapFrame::matrix() const {
  const auto& [xx, yx, yy, zx, zy, zz] = entries_;
  return Eigen::Matrix3d{{xx, 0, 0}, {yx, yy, 0}, {zx, zy, zz}};
}

Vector MapFrame::FromMap(const Vector& direction) const {
  if (is_plain_) return direction;
  const auto& [xx, yx, yy, zx, zy, zz] = entries_;
  const double x = direction.x() / xx;
  const double y = (direction.y() - yx * x) / yy;
  return {x, y, (direction.z() - zx * x - zy * y) / zz};
}

DirectionMap::DirectionMap(const MapFrame& frame) : frame_(frame), n_(1), half_(0.5) {
  gauges_.assign(corner_count(), INFINITY);
  hints_.assign(cell_count(), UINT32_MAX);
}

DirectionMap::DirectionMap(const MapFrame& frame, int resolution)
    : frame_(frame), n_(resolution), half_(0.5 * resolution) {
  gauges_.reserve(corner_count());
  hints_.reserve(cell_count());
}

void DirectionMap::AppendCorner(double reach) {
  HULLD_DCHECK(gauges_.size() < corner_count());
  gauges_.push_back((1 + kDirectionMapMargin) / reach);
}

void DirectionMap::AppendCell(uint32_t hint) {
  HULLD_DCHECK(hints_.size() < cell_count());
  hints_.push_back(hint);
}

Vector DirectionMap::CornerDirection(int face, int i, int j) const {
  HULLD_DCHECK(0 <= face && face < 6 && 0 <= i && i <= n_ && 0 <= j && j <= n_);
  return frame_.FromMap(
      CubeDirection(static_cast<uint32_t>(face), (i - half_) / half_, (j - half_) / half_));
}

// The gauge g of the set around c, in the frame, is convex and subadditive. |L| is the largest sum
// of a row's absolute entries, E the extent, u0 the unit roundoff.
//
// A corner: solving L w = d for its direction d is exact for a right side within 4 u0 |L| |w| of d
// (Higham 2002, 8.5), and its point, m w beyond c, is rounded by at most 2 u0 (|c| + m |w|), where
// m |w| is at most E. The point is therefore within u0 |L| (6 E + 2 |c|) of m d in the frame, and
// g(d) is at most 1 / m times 1 + u0 |L| (6 E + 2 |c|) max g, with max g over all directions.
//
// A point p: L (p - c) errs by at most 4 u0 |L| |p - c|, and g there is at least |p - c| / E,
// because the set is within E of c. The error is at most 4 u0 |L| E max g of itself. The direction
// at which it is interpolated is within 8 u0 of its own, which adds at most 8 u0 max g. The
// interpolation has positive terms and errs, with the distance and the stored gauges, by 16 u0 of
// itself, which is at least the least gauge.
//
// max g is at most 1 / least reach, the least gauge 1 / largest reach. Relative to the computed
// value the total is at most ratio (24 + 16 stretch) u0, with ratio = largest / least reach and
// stretch = |L| (E + |c|) / least reach; half of kDirectionMapMargin bounds it. Products that
// underflow add less than the slack, because distances are at least kMapMinDistance. Proven.
void DirectionMap::Finish(double min_reach, double largest_reach, double extent) {
  HULLD_CHECK(gauges_.size() == corner_count() && hints_.size() == cell_count());
  if (!(min_reach > 0)) return;
  const double ratio = largest_reach / min_reach;
  const double stretch =
      RowSumNorm(frame_.matrix()) * (extent + LargestComponent(center())) / min_reach;
  const double error = ratio * (24 + 16 * stretch) * kUnitRoundoff;
  rejects_ = error < 0.5 * kDirectionMapMargin;
}

bool DirectionMap::Coarsen() {
  if (n_ % 2 != 0) return false;
  DirectionMap coarse(frame_, n_ / 2);
  const auto cells = static_cast<size_t>(n_);
  for (size_t row = 0; row < 6 * cells; row += 2) {
    for (size_t k = 0; k < cells; k += 2) coarse.hints_.push_back(hints_[row * cells + k]);
  }
  for (size_t face = 0; face < 6; ++face) {
    for (size_t i = 0; i <= cells; i += 2) {
      const size_t row = (face * (cells + 1) + i) * (cells + 1);
      for (size_t k = 0; k <= cells; k += 2) coarse.gauges_.push_back(gauges_[row + k]);
    }
  }
  coarse.rejects_ = rejects_;
  *this = std::move(coarse);
  return true;
}

void DirectionMap::AppendSurvivors(std::span<const Vector> points, std::vector<uint32_t>& survivors,
                                   StopPoll& poll) const {
  // Processes the points in chunks, so that the buffer stays in the L1 cache.
  constexpr size_t kChunk = 1024;
  // Extra capacity, because four indices are written together.
  std::array<uint32_t, kChunk + 4> buffer;
  const bool has_avx2 = UsesAvx2() && rejects_;
  for (size_t first = 0; first < points.size() && !poll.Step(); first += kChunk) {
    const std::span<const Vector> chunk =
        points.subspan(first, std::min(kChunk, points.size() - first));
    uint32_t* end = buffer.data();
    const size_t done = has_avx2 ? WriteSurvivorsAvx2(chunk, end) : 0;
    for (size_t i = done; i < chunk.size(); ++i) {
      *end = static_cast<uint32_t>(i);
      end += IsCertainlyInside(PlaceOf(chunk[i])) ? 0 : 1;
    }
    for (const uint32_t* i = buffer.data(); i < end; ++i) {
      survivors.push_back(static_cast<uint32_t>(first) + *i);
    }
  }
}

#ifdef HULLD_HAS_AVX2_PATH
namespace {

// Steps of WriteSurvivorsAvx2, for four points together. Each performs the same operations as the
// scalar function that it names, so that the results are the same.

struct FourVectors {
  __m256d x;
  __m256d y;
  __m256d z;
};

// Loads four consecutive points.
[[gnu::target("avx2"), gnu::always_inline]] inline FourVectors LoadFour(const Vector* points) {
  const double* p = points->data();
  const __m256d a = _mm256_loadu_pd(p);      // x0 y0 z0 x1
  const __m256d b = _mm256_loadu_pd(p + 4);  // y1 z1 x2 y2
  const __m256d c = _mm256_loadu_pd(p + 8);  // z2 x3 y3 z3
  const __m256d ab = _mm256_permute2f128_pd(a, b, 0x30);
  const __m256d ac = _mm256_permute2f128_pd(a, c, 0x21);
  const __m256d bc = _mm256_permute2f128_pd(b, c, 0x30);
  return {_mm256_shuffle_pd(ab, ac, 0b1010), _mm256_shuffle_pd(ab, bc, 0b0101),
          _mm256_shuffle_pd(ac, bc, 0b1010)};
}

// MapFrame::ToMap.
class FrameOfFour {
 public:
  [[gnu::target("avx2"), gnu::always_inline]] explicit FrameOfFour(const MapFrame& frame)
      : center_{_mm256_set1_pd(frame.center().x()), _mm256_set1_pd(frame.center().y()),
                _mm256_set1_pd(frame.center().z())},
        is_plain_(frame.is_plain()),
        l_(frame.matrix()) {}

  [[gnu::target("avx2"), gnu::always_inline]] FourVectors ToMap(const FourVectors& points) const {
    __m256d x = _mm256_sub_pd(points.x, center_.x);
    __m256d y = _mm256_sub_pd(points.y, center_.y);
    __m256d z = _mm256_sub_pd(points.z, center_.z);
    if (!is_plain_) {
      z = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(_mm256_set1_pd(l_(2, 0)), x),
                                      _mm256_mul_pd(_mm256_set1_pd(l_(2, 1)), y)),
                        _mm256_mul_pd(_mm256_set1_pd(l_(2, 2)), z));
      y = _mm256_add_pd(_mm256_mul_pd(_mm256_set1_pd(l_(1, 0)), x),
                        _mm256_mul_pd(_mm256_set1_pd(l_(1, 1)), y));
      x = _mm256_mul_pd(_mm256_set1_pd(l_(0, 0)), x);
    }
    return {x, y, z};
  }

 private:
  FourVectors center_;
  bool is_plain_;
  Eigen::Matrix3d l_;
};

// OnCube.
struct FourOnCube {
  [[gnu::target("avx2"), gnu::always_inline]] explicit FourOnCube(const FourVectors& v) {
    const __m256d sign = _mm256_set1_pd(-0.0);
    const __m256d zero = _mm256_setzero_pd();
    const __m256d abs_x = _mm256_andnot_pd(sign, v.x);
    const __m256d abs_y = _mm256_andnot_pd(sign, v.y);
    const __m256d abs_z = _mm256_andnot_pd(sign, v.z);
    // NaN if y or z is NaN: the point is then out of range. x is never NaN.
    largest = _mm256_max_pd(abs_x, _mm256_max_pd(abs_y, abs_z));
    const __m256d is_x = _mm256_cmp_pd(abs_x, largest, _CMP_EQ_OQ);
    const __m256d is_y = _mm256_andnot_pd(is_x, _mm256_cmp_pd(abs_y, largest, _CMP_EQ_OQ));
    const __m256d along = _mm256_blendv_pd(_mm256_blendv_pd(v.z, v.y, is_y), v.x, is_x);
    first = _mm256_blendv_pd(_mm256_blendv_pd(v.x, v.z, is_y), v.y, is_x);
    second = _mm256_blendv_pd(_mm256_blendv_pd(v.y, v.x, is_y), v.z, is_x);
    face =
        _mm256_blendv_pd(_mm256_blendv_pd(_mm256_set1_pd(4), _mm256_set1_pd(2), is_y), zero, is_x);
    face = _mm256_add_pd(face,
                         _mm256_and_pd(_mm256_cmp_pd(along, zero, _CMP_LT_OQ), _mm256_set1_pd(1)));
  }
  __m256d face;
  __m256d largest;
  __m256d first;
  __m256d second;
};

// component * scale + half, from 0 to n.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256d AlongSide(__m256d component,
                                                                     __m256d scale, __m256d half,
                                                                     __m256d n) {
  const __m256d along = _mm256_add_pd(_mm256_mul_pd(component, scale), half);
  return _mm256_max_pd(_mm256_min_pd(along, n), _mm256_setzero_pd());
}

// Constants of DirectionMap::PlaceIn for a resolution.
struct GridOfFour {
  [[gnu::target("avx2"), gnu::always_inline]] explicit GridOfFour(int resolution)
      : half(_mm256_set1_pd(0.5 * resolution)),
        cells(_mm256_set1_pd(resolution)),
        last(_mm256_set1_pd(resolution - 1)),
        corners(_mm256_set1_pd(resolution + 1)) {}
  __m256d half;
  __m256d cells;
  __m256d last;
  __m256d corners;
};

// DirectionMap::PlaceIn, without the cell.
struct FourPlaces {
  [[gnu::target("avx2"), gnu::always_inline]] FourPlaces(const FourVectors& v,
                                                         const GridOfFour& grid) {
    const FourOnCube on_cube(v);
    distance = on_cube.largest;
    const __m256d scale = _mm256_div_pd(grid.half, distance);
    const __m256d first = AlongSide(on_cube.first, scale, grid.half, grid.cells);
    const __m256d second = AlongSide(on_cube.second, scale, grid.half, grid.cells);
    const __m256d row = _mm256_floor_pd(_mm256_min_pd(first, grid.last));
    const __m256d column = _mm256_floor_pd(_mm256_min_pd(second, grid.last));
    along_first = _mm256_sub_pd(first, row);
    along_second = _mm256_sub_pd(second, column);
    // A point whose distance is zero or out of range reads the first gauges and is kept.
    in_range = _mm256_and_pd(_mm256_cmp_pd(distance, _mm256_set1_pd(kMapMinDistance), _CMP_GE_OQ),
                             _mm256_cmp_pd(distance, _mm256_set1_pd(kMapMaxDistance), _CMP_LE_OQ));
    const __m256d in_row = _mm256_add_pd(_mm256_mul_pd(on_cube.face, grid.corners), row);
    const __m256d at = _mm256_add_pd(_mm256_mul_pd(in_row, grid.corners), column);
    _mm_store_si128(reinterpret_cast<__m128i*>(corner),
                    _mm256_cvttpd_epi32(_mm256_and_pd(at, in_range)));
  }
  alignas(16) int32_t corner[4];
  __m256d along_first;
  __m256d along_second;
  __m256d distance;
  __m256d in_range;
};

// Returns a if t is 0, b if it is 1.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256d Interpolate(__m256d a, __m256d b,
                                                                       __m256d t, __m256d rest) {
  return _mm256_add_pd(_mm256_mul_pd(a, rest), _mm256_mul_pd(b, t));
}

// The gauges at four corners, and at the next corner after each. Loads pairs, because four gathers
// take longer.
struct GaugesOfRow {
  [[gnu::target("avx2"), gnu::always_inline]] GaugesOfRow(const double* gauges, const int32_t* at) {
    const __m256d even = _mm256_loadu2_m128d(gauges + at[2], gauges + at[0]);
    const __m256d odd = _mm256_loadu2_m128d(gauges + at[3], gauges + at[1]);
    first = _mm256_unpacklo_pd(even, odd);
    second = _mm256_unpackhi_pd(even, odd);
  }
  __m256d first;
  __m256d second;
};

// DirectionMap::GaugeAt.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256d GaugesAt(const FourPlaces& places,
                                                                    const double* gauges,
                                                                    int resolution) {
  const __m256d one = _mm256_set1_pd(1);
  const GaugesOfRow low(gauges, places.corner);
  const GaugesOfRow high(gauges + resolution + 1, places.corner);
  const __m256d s = places.along_first;
  const __m256d t = places.along_second;
  const __m256d rest_s = _mm256_sub_pd(one, s);
  const __m256d rest_t = _mm256_sub_pd(one, t);
  return Interpolate(Interpolate(low.first, low.second, t, rest_t),
                     Interpolate(high.first, high.second, t, rest_t), s, rest_s);
}

// For each subset of four kept: the indices of its members, in order, followed by arbitrary values.
alignas(16) constexpr int32_t kKeptFirst[16][4] = {
    {0, 0, 0, 0}, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {2, 0, 0, 0}, {0, 2, 0, 0},
    {1, 2, 0, 0}, {0, 1, 2, 0}, {3, 0, 0, 0}, {0, 3, 0, 0}, {1, 3, 0, 0}, {0, 1, 3, 0},
    {2, 3, 0, 0}, {0, 2, 3, 0}, {1, 2, 3, 0}, {0, 1, 2, 3}};

}  // namespace

// IsCertainlyInside for four points together. Writes the survivors' indices to `end` and advances
// it beyond them, without branching on the result; up to four places beyond are overwritten.
// Returns the number of points processed.
__attribute__((target("avx2"))) size_t DirectionMap::WriteSurvivorsAvx2(
    std::span<const Vector> points, uint32_t*& end) const {
  // Local copies: for the compiler, the stores of the loop might alias members.
  const FrameOfFour frame(frame_);
  const GridOfFour grid(n_);
  const int resolution = n_;
  const double* const gauges = gauges_.data();
  size_t i = 0;
  for (; i + 4 <= points.size(); i += 4) {
    const FourPlaces places(frame.ToMap(LoadFour(&points[i])), grid);
    const __m256d gauge = GaugesAt(places, gauges, resolution);
    const __m256d inside = _mm256_and_pd(
        _mm256_cmp_pd(_mm256_mul_pd(places.distance, gauge), _mm256_set1_pd(1), _CMP_LT_OQ),
        places.in_range);
    const auto kept = static_cast<unsigned>(~_mm256_movemask_pd(inside)) & 0b1111;
    const __m128i numbers = _mm_load_si128(reinterpret_cast<const __m128i*>(kKeptFirst[kept]));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(end),
                     _mm_add_epi32(numbers, _mm_set1_epi32(static_cast<int>(i))));
    end += std::popcount(kept);
  }
  return i;
}
#else
size_t DirectionMap::WriteSurvivorsAvx2(std::span<const Vector>, uint32_t*&) const { return 0; }
#endif

}  // namespace hulld
