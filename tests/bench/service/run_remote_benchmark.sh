#!/bin/bash
# Measures hulld over the wire, compared with a no-op server and with core in one process, and keeps
# the rows in tests/bench/results/.
#
#   bash tests/bench/service/run_remote_benchmark.sh [MACHINE] [FLAG OF hulld...]
#
# TMPDIR: a folder on the disk to measure the durable store on. MACHINE names the file, as in
# remote_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by default. Each row is the median of ROUNDS
# (9) rounds of SECONDS_EACH (1) seconds. HULLD_DATA: the folder with the links of the UR5. Requires
# the packages in docker/packages.txt under [build] and [bench], and an otherwise idle machine:
# client and server share its cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
flags=()
for flag in "$@"; do flags+=("--hulld-flag=$flag"); done
# Waiting threads yield their cores to working threads, even if other programs run.
export OMP_WAIT_POLICY=passive

cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
cmake --build --preset release --target remote_benchmark
build/release/bin/remote_benchmark --out "tests/bench/results/remote_$machine.csv" \
  --rounds "${ROUNDS:-9}" --seconds "${SECONDS_EACH:-1}" "${flags[@]}"
# The tables in the pages are about this machine.
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
