#include "core/hull/growth/direction_map.h"

#include <algorithm>
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
DirectionMap::DirectionMap(const Vector& center) : center_(center), n_(1), half_(0.5) {
  radii_.assign(cell_count(), 0);
  hints_.assign(cell_count(), UINT32_MAX);
}

DirectionMap::DirectionMap(const Vector& center, int resolution)
    : center_(center), n_(resolution), half_(0.5 * resolution) {
  radii_.reserve(cell_count());
  hints_.reserve(cell_count());
}

void DirectionMap::AppendCell(double reach, uint32_t hint) {
  HULLD_DCHECK(radii_.size() < cell_count());
  radii_.push_back((1 - kDirectionMapMargin) * reach);
  hints_.push_back(hint);
}

Vector DirectionMap::CornerDirection(int face, int i, int j) const {
  HULLD_DCHECK(0 <= face && face < 6 && 0 <= i && i <= n_ && 0 <= j && j <= n_);
  return CubeDirection(static_cast<uint32_t>(face), (i - half_) / half_, (j - half_) / half_);
}

// The gauge g of the set round c is convex and subadditive. A point's computed direction u is
// within 8 u0 (u0 the unit roundoff) of its cell, a corner's point within 2 u0 (|c| + m) / m of the
// corner's direction, so g(u) <= max g(corners) + (8 + 4 (|c| + m) / m) u0 * max g over all
// directions. Relative to the least reach of the cell the second term is at most `ratio` (8 + 4
// (kappa + ratio)) u0, with ratio = largest / least reach and kappa = |c| / least reach; half of
// kDirectionMapMargin bounds it. Proven.
void DirectionMap::Finish(double least_reach, double largest_reach) {
  HULLD_CHECK(radii_.size() == cell_count());
  if (!(least_reach > 0)) return;
  const double ratio = largest_reach / least_reach;
  const double kappa = center_.cwiseAbs().maxCoeff() / least_reach;
  const double error = ratio * (8 + 4 * (kappa + ratio)) * kUnitRoundoff;
  rejects_ = error < 0.5 * kDirectionMapMargin;
}

void DirectionMap::Coarsen() {
  if (n_ % 2 != 0) return;
  DirectionMap coarse(center_, n_ / 2);
  const auto row = static_cast<size_t>(n_);
  for (size_t top = 0; top < radii_.size(); top += 2 * row) {
    for (size_t k = top; k < top + row; k += 2) {
      const double least = std::min(std::min(radii_[k], radii_[k + 1]),
                                    std::min(radii_[k + row], radii_[k + row + 1]));
      coarse.radii_.push_back(least);
      coarse.hints_.push_back(hints_[k + row + 1]);
    }
  }
  coarse.rejects_ = rejects_;
  *this = std::move(coarse);
}

void DirectionMap::AppendSurvivors(std::span<const Vector> points,
                                   std::vector<uint32_t>& survivors) const {
  const size_t done =
      CurrentSimdPath() == SimdPath::kAvx2 && rejects_ ? AppendSurvivorsAvx2(points, survivors) : 0;
  AppendSurvivorsBaseline(points, done, survivors);
}

void DirectionMap::AppendSurvivorsBaseline(std::span<const Vector> points, size_t from,
                                           std::vector<uint32_t>& survivors) const {
  for (size_t i = from; i < points.size(); ++i) {
    if (!IsCertainlyInside(PlaceOf(points[i]))) survivors.push_back(static_cast<uint32_t>(i));
  }
}

#ifdef HULLD_HAS_AVX2_PATH
namespace {

// The largest integer that is no more than component * scale + half, from 0 to `last`.
__attribute__((target("avx2"))) inline __m256d CellIndices(__m256d component, __m256d scale,
                                                           __m256d half, __m256d last) {
  const __m256d index = _mm256_add_pd(_mm256_mul_pd(component, scale), half);
  return _mm256_floor_pd(_mm256_max_pd(_mm256_min_pd(index, last), _mm256_setzero_pd()));
}

}  // namespace

// Four points at a time, operation by operation as PlaceOf and OnCube compute, so that the results
// are the same. Returns how many points it has done.
__attribute__((target("avx2"))) size_t DirectionMap::AppendSurvivorsAvx2(
    std::span<const Vector> points, std::vector<uint32_t>& survivors) const {
  const __m256d center_x = _mm256_set1_pd(center_.x());
  const __m256d center_y = _mm256_set1_pd(center_.y());
  const __m256d center_z = _mm256_set1_pd(center_.z());
  const __m256d sign = _mm256_set1_pd(-0.0);
  const __m256d zero = _mm256_setzero_pd();
  const __m256d half = _mm256_set1_pd(half_);
  const __m256d n = _mm256_set1_pd(n_);
  const __m256d last = _mm256_set1_pd(n_ - 1);
  const __m256d least = _mm256_set1_pd(kMapMinDistance);
  const __m256d largest = _mm256_set1_pd(kMapMaxDistance);
  size_t i = 0;
  for (; i + 4 <= points.size(); i += 4) {
    const double* p = points[i].data();
    const __m256d a = _mm256_loadu_pd(p);      // x0 y0 z0 x1
    const __m256d b = _mm256_loadu_pd(p + 4);  // y1 z1 x2 y2
    const __m256d c = _mm256_loadu_pd(p + 8);  // z2 x3 y3 z3
    const __m256d ab = _mm256_permute2f128_pd(a, b, 0x30);
    const __m256d ac = _mm256_permute2f128_pd(a, c, 0x21);
    const __m256d bc = _mm256_permute2f128_pd(b, c, 0x30);
    const __m256d x = _mm256_sub_pd(_mm256_shuffle_pd(ab, ac, 0b1010), center_x);
    const __m256d y = _mm256_sub_pd(_mm256_shuffle_pd(ab, bc, 0b0101), center_y);
    const __m256d z = _mm256_sub_pd(_mm256_shuffle_pd(ac, bc, 0b1010), center_z);
    const __m256d abs_x = _mm256_andnot_pd(sign, x);
    const __m256d abs_y = _mm256_andnot_pd(sign, y);
    const __m256d abs_z = _mm256_andnot_pd(sign, z);
    const __m256d m = _mm256_max_pd(abs_x, _mm256_max_pd(abs_y, abs_z));
    const __m256d is_x = _mm256_cmp_pd(abs_x, m, _CMP_EQ_OQ);
    const __m256d is_y = _mm256_andnot_pd(is_x, _mm256_cmp_pd(abs_y, m, _CMP_EQ_OQ));
    const __m256d along = _mm256_blendv_pd(_mm256_blendv_pd(z, y, is_y), x, is_x);
    const __m256d first = _mm256_blendv_pd(_mm256_blendv_pd(x, z, is_y), y, is_x);
    const __m256d second = _mm256_blendv_pd(_mm256_blendv_pd(y, x, is_y), z, is_x);
    __m256d face =
        _mm256_blendv_pd(_mm256_blendv_pd(_mm256_set1_pd(4), _mm256_set1_pd(2), is_y), zero, is_x);
    face = _mm256_add_pd(face,
                         _mm256_and_pd(_mm256_cmp_pd(along, zero, _CMP_LT_OQ), _mm256_set1_pd(1)));
    const __m256d scale = _mm256_div_pd(half, m);
    const __m256d row = CellIndices(first, scale, half, last);
    const __m256d column = CellIndices(second, scale, half, last);
    const __m256d cell =
        _mm256_add_pd(_mm256_mul_pd(_mm256_add_pd(_mm256_mul_pd(face, n), row), n), column);
    // A distance out of range, or zero, reads no radius and keeps its point.
    const __m256d in_range =
        _mm256_and_pd(_mm256_cmp_pd(m, least, _CMP_GE_OQ), _mm256_cmp_pd(m, largest, _CMP_LE_OQ));
    const __m256d radius =
        _mm256_mask_i32gather_pd(zero, radii_.data(), _mm256_cvttpd_epi32(cell), in_range, 8);
    const __m256d inside = _mm256_cmp_pd(m, radius, _CMP_LT_OQ);
    for (int kept = ~_mm256_movemask_pd(inside) & 0b1111; kept != 0; kept &= kept - 1) {
      survivors.push_back(static_cast<uint32_t>(i) +
                          static_cast<uint32_t>(std::countr_zero(static_cast<unsigned>(kept))));
    }
  }
  return i;
}
#else
size_t DirectionMap::AppendSurvivorsAvx2(std::span<const Vector>, std::vector<uint32_t>&) const {
  return 0;
}
#endif

}  // namespace hulld
