#ifndef HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_
#define HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_

namespace hulld::bench {

// Rows scene/N of SET/METHOD: N hulls of the set at random poses in a cube, so dense that each
// meets a few; all move, then all colliding pairs are found. The methods are hulld and FCL's
// dynamic tree of bounding boxes. `pairs` is how many were found, `wrong` how far that is from
// hulld's number, and `ns` the time of the whole scene.
void RegisterScenes();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_
