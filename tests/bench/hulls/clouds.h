#ifndef HULLD_TESTS_BENCH_HULLS_CLOUDS_H_
#define HULLD_TESTS_BENCH_HULLS_CLOUDS_H_

#include <string>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::bench {

// Returns points for hulls, by name: "ball:N", "sphere:N", "cube:N" (uniform, fixed seeds),
// "scan:N" (a dented ellipsoid, scanned from all sides in N points with noise), "lattice:N" (N^3
// points, rotated by irrational angles), or "mesh:FILE" (the vertices of an OBJ file in HULLD_DATA,
// by default ../shared/data). Empty if the file is missing.
std::vector<Vector> MakeCloud(const std::string& name);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_HULLS_CLOUDS_H_
