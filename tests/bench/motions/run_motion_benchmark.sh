#!/bin/bash
# Measures first contacts of motions, and rays against a running server; keeps the rows in
# tests/bench/results/motions/.
#
#   bash tests/bench/motions/run_motion_benchmark.sh [MACHINE] [SUITE...]
#
# MACHINE names the files, as in first_contact_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. SUITEs are motions and rays; both by default. REPETITIONS (5): each row of motions is the
# median of this many runs. Requires the packages in docker/packages.txt under [build], [test] and
# [bench]. The rows alternate, so that load affects all alike.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
suites=("$@")
((${#suites[@]})) || suites=(motions rays)
results=tests/bench/results
programs=build/release/bin

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target motion_benchmark ray_benchmark

for suite in "${suites[@]}"; do
  case $suite in
    motions)
      out=$results/motions/first_contact_$machine.csv
      "$programs/motion_benchmark" --benchmark_out="$out" \
        --benchmark_repetitions="${REPETITIONS:-5}" --benchmark_enable_random_interleaving=true \
        --benchmark_report_aggregates_only=true
      { head -1 "$out" && tail -n +2 "$out" | sort -t, -k1,1V -k2,2; } >"$out.sorted"
      mv "$out.sorted" "$out"
      ;;
    rays) "$programs/ray_benchmark" >"$results/motions/first_contact_rays_$machine.csv" ;;
    *)
      echo "run_motion_benchmark.sh: unknown suite $suite" >&2
      exit 2
      ;;
  esac
done
# The tables in the pages are about this machine.
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
