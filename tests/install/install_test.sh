#!/bin/bash
# Installs a build and uses what was installed, as a project of somebody else does.
#
#   install_test.sh BUILD_DIRECTORY WORK_DIRECTORY COMPILER
set -euo pipefail

build=$1 work=$2/work compiler=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
server=
trap '[[ -z $server ]] || { kill "$server"; wait "$server" || true; }' EXIT

rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/prefix" >"$work/install.log"
cmake -S "$here/consumer" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/configure.log"
cmake --build "$work/consumer" >"$work/build.log" || { cat "$work/build.log"; exit 1; }

"$work/prefix/bin/hulld" --store memory --listen 127.0.0.1:0 2>"$work/hulld.log" &
server=$!
until address=$(sed -n 's/.*listening on //p' "$work/hulld.log") && [[ -n $address ]]; do
  kill -0 "$server"
  sleep 0.1
done
"$work/prefix/bin/hullctl" --server "$address" create from/hullctl
"$work/consumer/consumer" "$address" from/hullctl
