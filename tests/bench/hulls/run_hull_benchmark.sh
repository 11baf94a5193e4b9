#!/bin/bash
# Measures hull building and keeps the rows and the plot in tests/bench/results/.
#
#   bash tests/bench/hulls/run_hull_benchmark.sh [MACHINE] [SUITE...]
#
# MACHINE names the files, as in hull_build_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. SUITEs are build, snapshot, stream, cost and extremes; all by default, which takes a few
# minutes. Requires the packages in docker/packages.txt under [build], [test] and [bench], and an
# otherwise idle machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
suites=("$@")
((${#suites[@]})) || suites=(build snapshot stream cost extremes)
results=tests/bench/results
programs=build/release/bin

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target hull_benchmark extreme_benchmark

for suite in "${suites[@]}"; do
  out=$results/hull_${suite}_$machine.csv
  case $suite in
    # Alternates with peers, so that machine drift affects all alike.
    build | snapshot | stream | cost)
      "$programs/hull_benchmark" --benchmark_filter="^$suite/" --benchmark_out="$out" \
        --benchmark_enable_random_interleaving=true
      { head -1 "$out" && tail -n +2 "$out" | sort -t, -k1,1V -k2,2; } >"$out.sorted"
      mv "$out.sorted" "$out"
      ;;
    extremes) "$programs/extreme_benchmark" --benchmark_out="$out" ;;
    *)
      echo "run_hull_benchmark.sh: unknown suite $suite" >&2
      exit 2
      ;;
  esac
done
if [[ -f $results/hull_cost_$machine.csv ]]; then bash tests/bench/hulls/plot_hull_cost.sh "$machine"; fi
# The tables in the pages are about this machine.
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
