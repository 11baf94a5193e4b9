#!/bin/bash
# Measures how soon watches hear of changes, and what a store that changes all the time gives them;
# keeps the rows in tests/bench/results/.
#
#   bash tests/bench/service/run_watch_benchmark.sh [MACHINE]
#
# MACHINE names the file, as in server_watch_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. HULLD: another program to measure. Starts a hulld of its own, whose store is memory.
# Nothing else should run on the machine meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
out=tests/bench/results/server_watch_$machine.csv

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target hulld watch_benchmark
build/release/bin/watch_benchmark "${HULLD:-build/release/bin/hulld}" >"$out"
column -s, -t "$out"
