#ifndef HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_
#define HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_

namespace hulld::bench {

// Rows scene/N of SET/METHOD: N hulls of the set at random poses in a cube, so dense that
// each meets a few; all move, then all colliding pairs are found. Of hulld and of FCL's dynamic
// tree of bounding boxes. `pairs` is how many were found, `wrong` by how many that differs from
// hulld, `ns` is of the whole scene.
void RegisterScenes();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_
