#!/bin/bash
# Measures single pairs while batches run, and keeps the rows in tests/bench/results/.
#
#   bash tests/bench/service/run_overload_benchmark.sh [MACHINE]
#
# MACHINE names the file, as in server_overload_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by
# default. Starts its own hulld on a free port of 127.0.0.1. Requires an otherwise idle machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
out=tests/bench/results/server_overload_$machine.csv

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target hulld overload_benchmark

log=$(mktemp)
build/release/bin/hulld --store memory --listen 127.0.0.1:0 2>"$log" &
server=$!
trap 'kill "$server"; wait "$server" || true; rm -f "$log"' EXIT
until address=$(sed -n 's/.*listening on //p' "$log") && [[ -n $address ]]; do
  kill -0 "$server"
  sleep 0.1
done
build/release/bin/overload_benchmark "$address" "${ROUNDS:-5}" "${CALLS:-2000}" >"$out"
column -s, -t "$out"
# The tables in the pages are about this machine.
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
