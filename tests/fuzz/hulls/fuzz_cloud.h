#ifndef HULLD_TESTS_FUZZ_HULLS_FUZZ_CLOUD_H_
#define HULLD_TESTS_FUZZ_HULLS_FUZZ_CLOUD_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::fuzz {

// A stream of points for a hull, and its division into blocks.
struct FuzzCloud {
  // May contain NaN and infinities.
  std::vector<Vector> points;
  // Sizes of consecutive blocks; they sum to the number of points.
  std::vector<size_t> block_sizes;
};

// Decodes any bytes into a cloud of at most kMaxPoints points. The bytes are a program: small
// integers, raw doubles, repeated points, neighbors one unit in the last place away, points on the
// lines and in the planes of earlier points (exactly or up to rounding), powers of two from the
// subnormals to the largest doubles, runs, grids, and scatters. So cases that are rare among random
// coordinates are common here. Deterministic.
FuzzCloud DecodeFuzzCloud(std::span<const uint8_t> bytes);

inline constexpr size_t kMaxPoints = 400;

}  // namespace hulld::fuzz

#endif  // HULLD_TESTS_FUZZ_HULLS_FUZZ_CLOUD_H_
