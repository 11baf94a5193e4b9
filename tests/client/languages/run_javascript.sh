#!/bin/bash
# Runs the JavaScript example of client/LANGUAGES.md against its own server.
#
#   run_javascript.sh PROGRAMS WORK
#
# PROGRAMS: the directory of hulld. WORK: a directory for its files, which is recreated. Debian has
# no @grpc/grpc-js. If HULLD_NODE_MODULES names a node_modules with it and @grpc/proto-loader, the
# test uses that; nothing is downloaded. Exit code 77: they are missing.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source=$(cd "$here/../../.." && pwd)
programs=$(cd "$1" && pwd)
work=$2
server=
trap '[[ -z $server ]] || { kill "$server"; wait "$server" || true; }' EXIT

command -v node >/dev/null || { echo "skipped: node is not installed"; exit 77; }
modules=${HULLD_NODE_MODULES:-}
for module in @grpc/grpc-js @grpc/proto-loader; do
  [[ -n $modules && -d $modules/$module ]] || {
    echo "skipped: Debian has no $module; install it with npm, and name its folder in HULLD_NODE_MODULES"
    exit 77
  }
done

rm -rf "$work"
mkdir -p "$work"
ln -s "$(cd "$modules" && pwd)" "$work/node_modules"
cp -r "$source/proto" "$work/proto"
bash "$source/tests/pages/extract_code.sh" "$source/client/LANGUAGES.md" js >"$work/collide.mjs"

"$programs/hulld" --store memory --listen 127.0.0.1:0 2>"$work/hulld.log" &
server=$!
until address=$(sed -n 's/.*listening on //p' "$work/hulld.log") && [[ -n $address ]]; do
  kill -0 "$server"
  sleep 0.1
done

cd "$work"
said=$(node collide.mjs "$address")
expected=$(bash "$source/tests/pages/extract_code.sh" "$source/client/LANGUAGES.md" text)
if [[ $said != "$expected" ]]; then
  printf 'the page says:\n%s\nit printed:\n%s\n' "$expected" "$said"
  exit 1
fi
