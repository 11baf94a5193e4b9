#!/bin/bash
# Measures the latency of watch events, and the event rate of a constantly changing store; keeps the
# rows in tests/bench/results/.
#
#   bash tests/bench/service/run_watch_benchmark.sh [MACHINE]
#
# MACHINE names the file, as in server_watch_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. HULLD: another program to measure. Starts its own hulld with an in-memory store. Requires
# an otherwise idle machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
out=tests/bench/results/server_watch_$machine.csv

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target hulld watch_benchmark
build/release/bin/watch_benchmark "${HULLD:-build/release/bin/hulld}" >"$out"
column -s, -t "$out"
