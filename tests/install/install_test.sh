#!/bin/bash
# Installs a build and uses the installation as a third-party project does.
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
for file in man/man1/hullctl.1 man/man1/hullctl-check.1 bash-completion/completions/hullctl \
  zsh/site-functions/_hullctl fish/vendor_completions.d/hullctl.fish; do
  [[ -s $work/prefix/share/$file ]] || { echo "share/$file is not installed"; exit 1; }
done
# Every installed header compiles: all of its includes are installed.
headers=$work/prefix/include/hulld
find "$headers" -name '*.h' -printf '#include "%P"\n' | sort >"$work/headers.cc"
(($(grep -c '"client/' "$work/headers.cc") > 10)) || { echo "few headers are installed"; exit 1; }
"$compiler" -std=c++20 -fsyntax-only -I "$headers" -isystem /usr/include/eigen3 "$work/headers.cc"
cmake -G Ninja -S "$here/consumer" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/configure.log"
cmake --build "$work/consumer" >"$work/build.log" || { cat "$work/build.log"; exit 1; }
# An installation of core alone, in another folder, needs neither components nor gRPC.
mkdir "$work/core"
cp -r "$work/prefix/include" "$work/prefix/lib" "$work/core"
rm "$work"/core/lib/cmake/hulld/hulld-client-*
cat >"$work/core/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(core LANGUAGES CXX)
find_package(hulld REQUIRED)
find_package(hulld QUIET COMPONENTS client)
if(hulld_FOUND OR NOT TARGET hulld::core)
  message(FATAL_ERROR "core is not found, or the client is")
endif()
END
cmake -G Ninja -S "$work/core" -B "$work/core/build" -DCMAKE_PREFIX_PATH="$work/core" \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_DISABLE_FIND_PACKAGE_gRPC=ON >"$work/core.log"
# The source tree as a part of another project.
cmake -G Ninja -S "$here/embedded" -B "$work/embedded" -DCMAKE_CXX_COMPILER="$compiler" >"$work/embedded.log"
[[ $(grep -A 9 core_consumer.dir "$work/embedded/build.ninja") == *-ffp-contract=off* ]]
# The CMake code of client/guide/CPP.md finds the package, too; tests/pages compiles the C++ code.
mkdir "$work/page"
pages=$here/../pages client_page=$here/../../client/guide/CPP.md
bash "$pages/extract_code.sh" "$client_page" cmake >"$work/page/CMakeLists.txt"
bash "$pages/extract_code.sh" "$client_page" cpp >"$work/page/example.cc"
cmake -G Ninja -S "$work/page" -B "$work/page/build" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/page/configure.log"

"$work/prefix/bin/hulld" --store memory --listen 127.0.0.1:0 2>"$work/hulld.log" &
server=$!
until address=$(sed -n 's/.*listening on //p' "$work/hulld.log") && [[ -n $address ]]; do
  kill -0 "$server"
  sleep 0.1
done
"$work/prefix/bin/hullctl" --server "$address" create from/hullctl
"$work/consumer/consumer" "$address" from/hullctl
