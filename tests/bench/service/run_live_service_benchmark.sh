#!/bin/bash
# Measures queries about a growing hull over the wire, compared with queries about a hull at rest;
# then scenes and streams of growing hulls, a depth camera, and scenes of hulls read from disk.
# Keeps the rows in tests/bench/results/. Takes a few minutes.
#
#   bash tests/bench/service/run_live_service_benchmark.sh [MACHINE] [VERTICES...]
#
# MACHINE names the files, as in server_live_MACHINE.csv and server_live_work_MACHINE.csv: a CPU and
# a compiler; epyc_gcc12 by default. VERTICES: 64 1000 10000 100000 1000000 by default. HULLD:
# another program to measure. Starts its own hulld, on a durable store. Requires an otherwise idle
# machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
out=tests/bench/results/server_live_$machine.csv

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target hulld live_service_benchmark live_workload_benchmark
hulld=${HULLD:-build/release/bin/hulld}
build/release/bin/live_service_benchmark "$hulld" "$@" >"$out"
column -s, -t "$out"
out=tests/bench/results/server_live_work_$machine.csv
build/release/bin/live_workload_benchmark "$hulld" >"$out"
column -s, -t "$out"
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
