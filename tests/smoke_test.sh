#!/bin/bash
# Sends queries to a server, end to end: smoke_test.sh PROGRAMS
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
answers=$(smoke_client "$address")
[[ $answers == $'RELATION_SEPARATED\nRELATION_TOUCHING\nRELATION_OVERLAPPING' ]] || { echo "wrong answers: $answers"; exit 1; }
