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

MapFrame::MapFrame(const Vector& center, double size) : center_(center) {
  // The limits keep the diagonal of L normal.
  const double scale = std::ldexp(1, -std::clamp(std::ilogb(size), -1000, 1000));
  entries_ = {scale, 0, scale, 0, 0, scale};
}

// L is the inverse of the Cholesky factor of the moments.
MapFrame::MapFrame(const Vector& center, double size, const Eigen::Matrix3d& moments)
    : MapFrame(center, size) {
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
  const double scale = entries_[0];
  const Eigen::Matrix3d l = inverse * (scale / inverse.cwiseAbs().maxCoeff());
  entries_ = {l(0, 0), l(1, 0), l(1, 1), l(2, 0), l(2, 1), l(2, 2)};
  is_plain_ = false;
}

Eigen::Matrix3d MapFrame::matrix() const {
  const auto& [xx, yx, yy, zx, zy, zz] = entries_;
  return Eigen::Matrix3d{{xx, 0, 0}, {yx, yy, 0}, {zx, zy, zz}};
}

Vector MapFrame::FromMap(const Vector& direction) const {
  if (is_plain_) return direction / entries_[0];
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
  gauges_.push_back(static_cast<float>(1 / reach));
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
// of a row's absolute entries, E the extent, u0 the unit roundoff of doubles, u1 that of floats.
//
// A corner: solving L w = d for its direction d is exact for a right side within 4 u0 |L| |w| of d
// (Higham 2002, 8.5), and its point, m w beyond c, is rounded by at most 2 u0 (|c| + m |w|), where
// m |w| is at most E. The point is therefore within u0 |L| (6 E + 2 |c|) of m d in the frame, and
// g(d) is at most 1 / m times 1 + u0 |L| (6 E + 2 |c|) max g, with max g over all directions.
//
// A point p: L (p - c) errs by at most 4 u0 |L| |p - c| in doubles, and g there is at least
// |p - c| / E, because the set is within E of c. The error is at most 4 u0 |L| E max g of itself.
// Converted to floats, a component and the distance err by u1 each, the scale and its product with
// the component by u1 each, up to half the resolution, and the sum by u1 of the resolution: the
// direction at which the gauge is interpolated is within 6 u1 of its own, which adds at most
// 7 u1 max g. The interpolation has positive terms; a stored gauge, the rest of a position, and
// two products and sums of each err by 8 u1 in total, and the distance and its product with the
// gauge by 2 u1. That is at most 11 u1 of itself, which is at least the least gauge.
//
// max g is at most 1 / least reach, the least gauge 1 / largest reach. Relative to the computed
// value the total is at most ratio (16 stretch u0 + 18 u1), with ratio = largest / least reach and
// stretch = |L| (E + |c|) / least reach; 20 u1 leaves slack. A limit of 1 - 2 e covers an
// error e, because rounding it to a float changes it by less than e. Within kMapMinDistance and
// kMapMaxDistance, underflow adds less than the slack. Proven.
void DirectionMap::Finish(double min_reach, double largest_reach, double extent) {
  HULLD_CHECK(gauges_.size() == corner_count() && hints_.size() == cell_count());
  if (!(min_reach >= kMapMinDistance && largest_reach <= kMapMaxDistance)) return;
  const double ratio = largest_reach / min_reach;
  const double stretch =
      RowSumNorm(frame_.matrix()) * (extent + LargestComponent(center())) / min_reach;
  const double error = ratio * (16 * stretch * kUnitRoundoff + 20 * kFloatUnitRoundoff);
  if (error < kDirectionMapMaxError) limit_ = static_cast<float>(1 - 2 * error);
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
  coarse.limit_ = limit_;
  *this = std::move(coarse);
  return true;
}

void DirectionMap::AppendSurvivors(std::span<const Vector> points, std::vector<uint32_t>& survivors,
                                   StopPoll& poll) const {
  // Processes the points in chunks, so that the buffer stays in the L1 cache.
  constexpr size_t kChunk = 1024;
  // Extra capacity, because four indices are written together.
  std::array<uint32_t, kChunk + 4> buffer;
  const bool has_avx2 = UsesAvx2() && limit_ > 0;
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

// Steps of WriteSurvivorsAvx2, for eight points together. Each performs the same operations as the
// scalar function that it names, so that the results are the same.

struct FourVectors {
  __m256d x;
  __m256d y;
  __m256d z;
};

struct EightVectors {
  __m256 x;
  __m256 y;
  __m256 z;
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

// Rounds to floats.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256 Narrow(__m256d low, __m256d high) {
  return _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low));
}

// MapFrame::ToMap.
class FrameOfEight {
 public:
  [[gnu::target("avx2"), gnu::always_inline]] explicit FrameOfEight(const MapFrame& frame)
      : center_{_mm256_set1_pd(frame.center().x()), _mm256_set1_pd(frame.center().y()),
                _mm256_set1_pd(frame.center().z())},
        is_plain_(frame.is_plain()),
        l_(frame.matrix()) {}

  // Returns the images of eight consecutive points.
  [[gnu::target("avx2"), gnu::always_inline]] EightVectors ToMap(const Vector* points) const {
    const FourVectors low = ToMap(LoadFour(points));
    const FourVectors high = ToMap(LoadFour(points + 4));
    return {Narrow(low.x, high.x), Narrow(low.y, high.y), Narrow(low.z, high.z)};
  }

 private:
  [[gnu::target("avx2"), gnu::always_inline]] FourVectors ToMap(const FourVectors& points) const {
    const __m256d x = _mm256_sub_pd(points.x, center_.x);
    const __m256d y = _mm256_sub_pd(points.y, center_.y);
    const __m256d z = _mm256_sub_pd(points.z, center_.z);
    if (is_plain_) return {Times(0, 0, x), Times(0, 0, y), Times(0, 0, z)};
    return {Times(0, 0, x), _mm256_add_pd(Times(1, 0, x), Times(1, 1, y)),
            _mm256_add_pd(_mm256_add_pd(Times(2, 0, x), Times(2, 1, y)), Times(2, 2, z))};
  }
  [[gnu::target("avx2"), gnu::always_inline]] __m256d Times(int i, int j, __m256d v) const {
    return _mm256_mul_pd(_mm256_set1_pd(l_(i, j)), v);
  }

  FourVectors center_;
  bool is_plain_;
  Eigen::Matrix3d l_;
};

// OnCube.
struct EightOnCube {
  [[gnu::target("avx2"), gnu::always_inline]] explicit EightOnCube(const EightVectors& v) {
    const __m256 sign = _mm256_set1_ps(-0.0f);
    const __m256 abs_x = _mm256_andnot_ps(sign, v.x);
    const __m256 abs_y = _mm256_andnot_ps(sign, v.y);
    const __m256 abs_z = _mm256_andnot_ps(sign, v.z);
    // NaN if y or z is NaN: the point is then out of range. x is never NaN.
    largest = _mm256_max_ps(abs_x, _mm256_max_ps(abs_y, abs_z));
    const __m256 is_x = _mm256_cmp_ps(abs_x, largest, _CMP_EQ_OQ);
    const __m256 is_y = _mm256_andnot_ps(is_x, _mm256_cmp_ps(abs_y, largest, _CMP_EQ_OQ));
    const __m256 along = _mm256_blendv_ps(_mm256_blendv_ps(v.z, v.y, is_y), v.x, is_x);
    first = _mm256_blendv_ps(_mm256_blendv_ps(v.x, v.z, is_y), v.y, is_x);
    second = _mm256_blendv_ps(_mm256_blendv_ps(v.y, v.x, is_y), v.z, is_x);
    const __m256 is_negative = _mm256_cmp_ps(along, _mm256_setzero_ps(), _CMP_LT_OQ);
    face = _mm256_add_ps(
        _mm256_blendv_ps(_mm256_andnot_ps(is_x, _mm256_set1_ps(4)), _mm256_set1_ps(2), is_y),
        _mm256_and_ps(is_negative, _mm256_set1_ps(1)));
  }
  __m256 face;
  __m256 largest;
  __m256 first;
  __m256 second;
};

// component * scale + half, from 0 to n.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256 AlongSide(__m256 component, __m256 scale,
                                                                    __m256 half, __m256 n) {
  const __m256 along = _mm256_add_ps(_mm256_mul_ps(component, scale), half);
  return _mm256_max_ps(_mm256_min_ps(along, n), _mm256_setzero_ps());
}

// Constants of DirectionMap::PlaceIn for a resolution.
struct GridOfEight {
  [[gnu::target("avx2"), gnu::always_inline]] explicit GridOfEight(float resolution)
      : half(_mm256_set1_ps(0.5f * resolution)),
        cells(_mm256_set1_ps(resolution)),
        last(_mm256_set1_ps(resolution - 1)),
        corners(_mm256_set1_ps(resolution + 1)) {}
  __m256 half;
  __m256 cells;
  __m256 last;
  __m256 corners;
};

// DirectionMap::PlaceIn, without the cell.
struct EightPlaces {
  [[gnu::target("avx2"), gnu::always_inline]] EightPlaces(const EightVectors& v,
                                                          const GridOfEight& grid) {
    const EightOnCube on_cube(v);
    distance = on_cube.largest;
    const __m256 scale = _mm256_div_ps(grid.half, distance);
    const __m256 first = AlongSide(on_cube.first, scale, grid.half, grid.cells);
    const __m256 second = AlongSide(on_cube.second, scale, grid.half, grid.cells);
    const __m256 row = _mm256_floor_ps(_mm256_min_ps(first, grid.last));
    const __m256 column = _mm256_floor_ps(_mm256_min_ps(second, grid.last));
    along_first = _mm256_sub_ps(first, row);
    along_second = _mm256_sub_ps(second, column);
    // A point out of range reads the first gauges and is kept.
    in_range = _mm256_and_ps(_mm256_cmp_ps(distance, _mm256_set1_ps(kMapMinDistance), _CMP_GE_OQ),
                             _mm256_cmp_ps(distance, _mm256_set1_ps(kMapMaxDistance), _CMP_LE_OQ));
    // Exact, because maps have fewer than 2^24 corners.
    const __m256 in_row = _mm256_add_ps(_mm256_mul_ps(on_cube.face, grid.corners), row);
    const __m256 at = _mm256_add_ps(_mm256_mul_ps(in_row, grid.corners), column);
    _mm256_store_si256(reinterpret_cast<__m256i*>(corner),
                       _mm256_cvttps_epi32(_mm256_and_ps(at, in_range)));
  }
  alignas(32) int32_t corner[8];
  __m256 along_first;
  __m256 along_second;
  __m256 distance;
  __m256 in_range;
};

// Returns a if t is 0, b if it is 1.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256 Interpolate(__m256 a, __m256 b, __m256 t,
                                                                      __m256 rest) {
  return _mm256_add_ps(_mm256_mul_ps(a, rest), _mm256_mul_ps(b, t));
}

// Returns two pairs of floats.
[[gnu::target("avx2"), gnu::always_inline]] inline __m128 LoadPairs(const float* low,
                                                                    const float* high) {
  const __m128i pair = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(low));
  return _mm_loadh_pi(_mm_castsi128_ps(pair), reinterpret_cast<const __m64*>(high));
}

// The gauges at eight corners, and at the next corner after each. Loads pairs, because gathers take
// longer.
struct GaugesOfRow {
  [[gnu::target("avx2"), gnu::always_inline]] GaugesOfRow(const float* gauges, const int32_t* at) {
    const __m256 even = _mm256_set_m128(LoadPairs(gauges + at[4], gauges + at[5]),
                                        LoadPairs(gauges + at[0], gauges + at[1]));
    const __m256 odd = _mm256_set_m128(LoadPairs(gauges + at[6], gauges + at[7]),
                                       LoadPairs(gauges + at[2], gauges + at[3]));
    first = _mm256_shuffle_ps(even, odd, 0b10'00'10'00);
    second = _mm256_shuffle_ps(even, odd, 0b11'01'11'01);
  }
  __m256 first;
  __m256 second;
};

// DirectionMap::GaugeAt.
[[gnu::target("avx2"), gnu::always_inline]] inline __m256 GaugesAt(const EightPlaces& places,
                                                                   const float* gauges,
                                                                   int resolution) {
  const __m256 one = _mm256_set1_ps(1);
  const GaugesOfRow low(gauges, places.corner);
  const GaugesOfRow high(gauges + resolution + 1, places.corner);
  const __m256 s = places.along_first;
  const __m256 t = places.along_second;
  const __m256 rest_s = _mm256_sub_ps(one, s);
  const __m256 rest_t = _mm256_sub_ps(one, t);
  return Interpolate(Interpolate(low.first, low.second, t, rest_t),
                     Interpolate(high.first, high.second, t, rest_t), s, rest_s);
}

// For each subset of four: the indices of its members, in order, followed by arbitrary values.
alignas(16) constexpr int32_t kMembers[16][4] = {
    {0, 0, 0, 0}, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {2, 0, 0, 0}, {0, 2, 0, 0},
    {1, 2, 0, 0}, {0, 1, 2, 0}, {3, 0, 0, 0}, {0, 3, 0, 0}, {1, 3, 0, 0}, {0, 1, 3, 0},
    {2, 3, 0, 0}, {0, 2, 3, 0}, {1, 2, 3, 0}, {0, 1, 2, 3}};

// Writes the indices of the members of a subset of four, shifted by `first`. Returns their end; up
// to four places beyond are overwritten.
[[gnu::target("avx2"), gnu::always_inline]] inline uint32_t* WriteMembers(unsigned subset,
                                                                          size_t first,
                                                                          uint32_t* end) {
  const __m128i members = _mm_load_si128(reinterpret_cast<const __m128i*>(kMembers[subset]));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(end),
                   _mm_add_epi32(members, _mm_set1_epi32(static_cast<int>(first))));
  return end + std::popcount(subset);
}

}  // namespace

// IsCertainlyInside for eight points together. Writes the survivors' indices to `end` and advances
// it beyond them, without branching on the result; up to four places beyond are overwritten.
// Returns the number of points processed.
__attribute__((target("avx2"))) size_t DirectionMap::WriteSurvivorsAvx2(
    std::span<const Vector> points, uint32_t*& end) const {
  // Local copies: for the compiler, the stores of the loop might alias members.
  const FrameOfEight frame(frame_);
  const GridOfEight grid(static_cast<float>(n_));
  const __m256 limit = _mm256_set1_ps(limit_);
  const int resolution = n_;
  const float* const gauges = gauges_.data();
  uint32_t* survivor = end;
  size_t i = 0;
  for (; i + 8 <= points.size(); i += 8) {
    const EightPlaces places(frame.ToMap(&points[i]), grid);
    const __m256 gauge = GaugesAt(places, gauges, resolution);
    const __m256 inside = _mm256_and_ps(
        _mm256_cmp_ps(_mm256_mul_ps(places.distance, gauge), limit, _CMP_LT_OQ), places.in_range);
    const auto kept = ~static_cast<unsigned>(_mm256_movemask_ps(inside)) & 0xFF;
    survivor = WriteMembers(kept & 0b1111, i, survivor);
    survivor = WriteMembers(kept >> 4, i + 4, survivor);
  }
  end = survivor;
  return i;
}
#else
size_t DirectionMap::WriteSurvivorsAvx2(std::span<const Vector>, uint32_t*&) const { return 0; }
#endif

}  // namespace hulld
