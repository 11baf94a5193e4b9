#!/bin/bash
# Measures collision queries and keeps the rows and the plot in tests/bench/results/.
#
#   bash tests/bench/queries/run_query_benchmark.sh [MACHINE] [SUITE...]
#
# MACHINE names the files, as in query_relation_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. SUITEs are relation, contact, distance, motion, batch, scene, live, accuracy and trade;
# all by default. REPETITIONS (5): each row is the median of this many runs. HULLD_DATA: the folder
# of meshes. Requires the packages in docker/packages.txt under [build], [test] and [bench], and an
# otherwise idle machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
suites=("$@")
((${#suites[@]})) || suites=(relation contact distance motion batch scene live accuracy trade)
results=tests/bench/results
programs=build/release/bin
# Waiting threads yield their cores to working threads, even if other programs run.
export OMP_WAIT_POLICY=passive

cmake --preset release -DHULLD_BUILD_BENCH=ON -DHULLD_BENCH_NATIVE=ON >/dev/null
cmake --build --preset release --target query_benchmark live_benchmark query_accuracy hulld-bench

for suite in "${suites[@]}"; do
  out=$results/query_${suite}_$machine.csv
  case $suite in
    # Alternates with peers, so that machine drift affects all alike.
    relation | contact | distance | motion | batch | scene)
      "$programs/query_benchmark" --benchmark_filter="^$suite/" --benchmark_out="$out" \
        --benchmark_repetitions="${REPETITIONS:-5}" --benchmark_enable_random_interleaving=true \
        --benchmark_report_aggregates_only=true
      { head -1 "$out" && tail -n +2 "$out" | sort -t, -k1,1V -k2,2; } >"$out.sorted"
      mv "$out.sorted" "$out"
      ;;
    live)
      "$programs/live_benchmark" "${VERTICES:-1000000}" "${SECONDS_EACH:-3}" >"$out"
      bash tests/bench/live/plot_live.sh "$machine"
      ;;
    # Counts are equal on every machine, so the file does not name one.
    accuracy) "$programs/query_accuracy" >$results/query_accuracy.csv ;;
    trade)
      "$programs/hulld-bench" trade --queries 4800 --csv "$out" --plot "$results/query_trade_$machine.svg"
      ;;
    *)
      echo "run_query_benchmark.sh: unknown suite $suite" >&2
      exit 2
      ;;
  esac
done
# The tables in the pages are about this machine.
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
