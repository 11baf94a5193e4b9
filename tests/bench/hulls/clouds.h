#ifndef HULLD_TESTS_BENCH_HULLS_CLOUDS_H_
#define HULLD_TESTS_BENCH_HULLS_CLOUDS_H_

#include <string>
#include <vector>

#include "core/numeric/vector.h"

namespace hulld::bench {

// Points to build hulls of, by name: "ball:N", "sphere:N", "cube:N" (uniform, fixed seeds),
// "scan:N" (a dented ellipsoid, seen all round in N points with noise), "lattice:N" (N^3 points,
// rotated by irrational angles) or "mesh:FILE" (the vertices of an OBJ
// file in HULLD_DATA, by default ../shared/data). Empty when the file is not there.
std::vector<Vector> MakeCloud(const std::string& name);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_HULLS_CLOUDS_H_
