#ifndef HULLD_TESTS_FUZZ_HULLS_FUZZ_CLOUD_H_
#define HULLD_TESTS_FUZZ_HULLS_FUZZ_CLOUD_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::fuzz {

// A stream of points to build a hull of, and where to cut it into blocks.
struct FuzzCloud {
  // May hold NaN and infinities.
  std::vector<Vector> points;
  // Sizes of consecutive blocks; they add up to the number of points.
  std::vector<size_t> block_sizes;
};

// Reads any bytes as a cloud of at most kMostPoints points. The bytes are a program: small
// integers, raw doubles, repeated points, neighbours one unit in the last place off, points on the
// lines and in the planes of earlier points (exactly or but for rounding), powers of two from the
// subnormals to the largest doubles, runs, grids and scatters. So that what is rare among random
// coordinates is common here. Deterministic.
FuzzCloud DecodeFuzzCloud(std::span<const uint8_t> bytes);

inline constexpr size_t kMostPoints = 400;

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_HULLS_FUZZ_CLOUD_H_
