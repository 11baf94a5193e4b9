#!/bin/bash
# Sends one query to a server, end to end: smoke_test.sh PROGRAMS
set -euo pipefail
export PATH=$1:$PATH
log=$(mktemp)
hulld --store memory --listen 127.0.0.1:0 2>"$log" &
server=$!
trap 'kill $server; wait $server || true; rm -f "$log"' EXIT
until address=$(sed -n 's/.*listening on //p' "$log") && [[ -n $address ]]; do
  kill -0 $server || { cat "$log"; exit 1; }
  sleep 0.1
done
ctl() { hullctl --server "$address" "$@"; }
ctl generate lattice 27 | ctl append cube - --create
for case in 2,0,0:TOUCHING 1,0,0:OVERLAPPING 2.0000000000000004,0,0:SEPARATED; do
  ctl check cube cube --pose-b "${case%:*}" | tee "$log.answer"
  grep -q "${case#*:}" "$log.answer"
done
rm -f "$log.answer"
