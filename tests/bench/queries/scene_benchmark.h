#ifndef HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_
#define HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_

namespace hulld::bench {

// Registers rows scene/N of SET/METHOD: N hulls of the set at random poses in a cube, so dense that
// each meets a few; all move, then all colliding pairs are found. The methods are hulld and FCL's
// dynamic tree of bounding boxes. `pairs`: the number found; `wrong`: its difference from hulld's
// number; `ns`: the time of the whole scene.
void RegisterScenes();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_SCENE_BENCHMARK_H_
