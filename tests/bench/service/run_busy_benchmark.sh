#!/bin/bash
# Measures batches, scenes, steps of streams, and single pairs alone and next to busy programs, and
# keeps the rows in tests/bench/results/.
#
#   bash tests/bench/service/run_busy_benchmark.sh [MACHINE] [FLAG OF hulld...]
#
# MACHINE names the file, as in server_busy_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. ROUNDS (5). HULLD: another program to measure. Starts its own hulld on a free port of
# 127.0.0.1. Requires an otherwise idle machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
out=tests/bench/results/server_busy_$machine.csv

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target busy_benchmark
build/release/bin/busy_benchmark "${HULLD:-build/release/bin/hulld}" "${ROUNDS:-5}" "$@" >"$out"
column -s, -t "$out"
