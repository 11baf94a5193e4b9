#!/usr/bin/env bash
# Measures everything about queries anew: builds, runs, and writes the rows to tests/bench/results.
#
#   bash tests/bench/run_query_benchmark.sh NAME [SET ...]
#
# NAME tells the machine and the compiler, as in "epyc_gcc12". SETs are those of query_benchmark, all
# by default. HULLD_DATA: the folder of meshes. REPETITIONS: 5 by default; medians count.
set -euo pipefail
cd "$(dirname "$0")/../.."
name=${1:?name the machine and the compiler, as in epyc_gcc12}
shift
sets=("$@")
[ ${#sets[@]} -gt 0 ] || sets=(sphere:8 sphere:64 sphere:512 sphere:10000 ur5)
repetitions=${REPETITIONS:-5}
results=tests/bench/results

cmake --preset release -DHULLD_BUILD_BENCH=ON
cmake --build --preset release --target query_benchmark query_accuracy hulld-bench
programs=build/release/tests/bench

rows=$(mktemp -d)
trap 'rm -rf "$rows"' EXIT
# One process per set: what one set keeps in memory does not slow the next.
for set in "${sets[@]}"; do
  echo "$set"
  "$programs/query_benchmark" --benchmark_filter="^$set/" --benchmark_repetitions="$repetitions" \
    --benchmark_enable_random_interleaving=true --benchmark_report_aggregates_only=true \
    --benchmark_out="$rows/$set.csv" > "$rows/$set.txt"
done
head -n 1 "$rows/${sets[0]}.csv" > "$results/query_$name.csv"
for set in "${sets[@]}"; do
  tail -n +2 "$rows/$set.csv" >> "$results/query_$name.csv"
done
"$programs/query_accuracy" > "$results/query_accuracy.csv"
"$programs/hulld-bench" trade --csv "$results/trade_$name.csv" --plot tests/bench/trade.svg
