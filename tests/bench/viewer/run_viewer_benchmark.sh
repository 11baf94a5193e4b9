#!/bin/bash
# Measures the time of the viewer's page to show large scenes, and to draw a frame of them, with
# software rendering; keeps the rows in its own folder.
#
#   bash tests/bench/viewer/run_viewer_benchmark.sh [MACHINE]
#
# MACHINE names the file, as in viewer_MACHINE.csv: a CPU and a compiler; epyc_gcc12 by default.
# Requires chromium, chromium-driver and python3-selenium, and an otherwise idle machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
out=tests/bench/viewer/viewer_$machine.csv

cmake --preset release >/dev/null
cmake --build --preset release --target hulld hullctl
/usr/bin/python3 tests/bench/viewer/viewer_benchmark.py build/release/bin >"$out"
column -s, -t "$out"
