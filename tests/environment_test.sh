#!/bin/bash
# hulld and hullctl with standard streams that are closed or full, and in a directory that no longer
# exists: environment_test.sh PROGRAMS
set -euo pipefail
export PATH=$1:$PATH
work=$(mktemp -d)
cd "$work"
export HOME=$work
hulld --data-dir store --listen unix:socket </dev/null >&- 2>&- &
server=$!
trap 'kill $server 2>/dev/null && wait $server || true; rm -rf "$work"' EXIT
until hullctl health --server unix:socket >/dev/null 2>&1; do
  kill -0 $server
  sleep 0.1
done
for stream in 1 2; do
  file=$(readlink /proc/$server/fd/$stream)
  [[ $file == /dev/null ]] || { echo "$file is stream $stream of hulld"; exit 1; }
done
hullctl create box --server unix:socket >/dev/null
hullctl backup save backup --server unix:socket >/dev/null
kill $server
wait $server

# Each command must fail, and say so on the other stream.
for command in "hulld --help" "hulld --version" "hulld --check-config" "hulld doctor --data-dir store" \
  "hullctl --help" "hullctl --version" "hullctl generate lattice 8"; do
  ! $command >/dev/full 2>errors || { echo "$command succeeded on a full disk"; exit 1; }
  grep -q "cannot write" errors || { echo "$command: $(cat errors)"; exit 1; }
  ! $command >&- 2>errors || { echo "$command succeeded without a standard output"; exit 1; }
  grep -q "cannot write" errors || { echo "$command: $(cat errors)"; exit 1; }
done

# The end of the reader ends a program silently.
hullctl generate sphere 10000 2>errors | head -n 1 >/dev/null || [[ ${PIPESTATUS[0]} == 141 ]]
[[ ! -s errors ]] || { echo "a closed pipe: $(cat errors)"; exit 1; }

# Below some twenty descriptors, gRPC would abort.
code=0
(ulimit -n 16 && exec hulld --data-dir few --listen unix:few-socket) 2>errors || code=$?
[[ $code == 1 ]] && grep -q "limit on open files is 16" errors || { echo "16 descriptors: $code, $(cat errors)"; exit 1; }

ln -s missing dangling
! hulld --check-config --data-dir dangling >/dev/null || { echo "a dangling link was accepted"; exit 1; }

# An empty TMPDIR stands for the default.
TMPDIR='' HULLD_BINARY=$1/hulld hullctl list --local >/dev/null
code=0
TMPDIR=$work/missing HULLD_BINARY=$1/hulld hullctl list --local || code=$?
[[ $code == 2 ]] || { echo "a missing TMPDIR: $code"; exit 1; }

mkdir gone
cd gone
rmdir "$work/gone"
for command in "hullctl context add a --server a:1 --token-file token" \
  "hullctl backup restore $work/backup --data-dir restored" "hulld --check-config --data-dir store"; do
  code=0
  $command >/dev/null || code=$?
  [[ $code == 2 ]] || { echo "$command ended with $code in a directory that does not exist"; exit 1; }
done
