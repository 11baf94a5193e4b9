#!/bin/bash
# Demonstrates textbook collision scenes end to end, as a new user would run them:
#
#   bash client/demo.sh
#
# On a bare Debian 12, first installs the packages in docker/packages.txt (as root) and builds hulld
# and hullctl into build/demo. Then starts a server, registers hulls, runs queries with known
# answers, streams points into a hull while querying it, and writes one page. Stops everything
# that it started, and fails if an answer differs from the expected one.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export LC_ALL=C

readonly build=$PWD/build/demo
readonly work=$build/scenes
readonly models=/usr/share/assimp/models/OBJ
# Quaternion of a half turn about z: maps (x, y, z) to (-x, -y, z) exactly.
readonly half_turn=0,0,0,1
wrong=0
server_pid=
writer_pid=

stop_everything() {
  local pid
  for pid in $writer_pid $server_pid; do
    kill "$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || true
  done
  writer_pid=
  server_pid=
}
trap stop_everything EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

heading() { printf '\n== %s\n' "$*"; }

ctl() { "$build/bin/hullctl" --server "$address" "$@"; }

# field NAME: prints the value of a row of a hullctl table read from standard input.
field() { awk -F '  +' -v name="$1" '$1 == name { print $2 }'; }

# expect WANT GOT: reports and counts a wrong answer.
expect() {
  [[ $1 == "$2" ]] && return 0
  printf '  WRONG: expected %s, got %s\n' "$1" "$2"
  wrong=$((wrong + 1))
}

# phase TEXT: starts a phase and prints the time since the start.
phase() { printf '[%2d:%02d] %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$*"; }

# Prints the build's percentage on a terminal; passes its output on to a log.
show_progress() {
  if [[ -t 1 ]]; then
    tee "$1" | awk -F '[][/]' '/^\[[0-9]+\/[0-9]+\]/ { printf "\r        %3d %%", 100 * $2 / $3; fflush() }
                               END { printf "\r              \r" }'
  else
    cat >"$1"
  fi
}

install_and_build() {
  phase "Installing packages (about 1 minute the first time)"
  bash docker/packages.sh install build models >"$work/packages.log" 2>&1 ||
    { cat "$work/packages.log"; exit 1; }
  phase "Building hulld and hullctl (4 to 7 minutes on 2 cores the first time)"
  command -v ccache >/dev/null && export CMAKE_CXX_COMPILER_LAUNCHER=ccache
  { cmake --preset release -B "$build" -DHULLD_BUILD_TESTS=OFF &&
    cmake --build "$build" --target hulld hullctl --parallel "$(nproc)"; } 2>&1 |
    show_progress "$work/build.log" ||
    { tail -n 40 "$work/build.log"; echo "The build failed; see $work/build.log"; exit 1; }
  phase "Running queries with known answers"
}

start_server() {
  local port=50551
  # Uses the default port, or the next free one.
  while (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do port=$((port + 1)); done
  address=127.0.0.1:$port
  heading "Starting hulld on $address"
  # Starts with an empty store, without the hulls of the last run.
  rm -rf "$work/data"
  "$build/bin/hulld" --listen "$address" --data-dir "$work/data" >"$work/hulld.log" 2>&1 &
  server_pid=$!
  for _ in {1..100}; do
    if ctl status >"$work/status" 2>&1; then
      printf '  version %s, store %s\n' "$(field version <"$work/status")" "$(field store <"$work/status")"
      return 0
    fi
    kill -0 "$server_pid" 2>/dev/null || break
    sleep 0.1
  done
  echo "The server did not start:"
  cat "$work/hulld.log"
  exit 1
}

# register NAME FILE: appends the points of a file to a hull and shows the result.
register() {
  ctl append "$1" "$2" --create >/dev/null
  ctl get "$1" --audit >"$work/hull"
  expect ok "$(field audit <"$work/hull")"
  printf '  %-8s %s\n           %s vertices, %s edges, %s facets; audit %s\n' "$1" \
    "$(field points <"$work/hull")" "$(field vertices <"$work/hull")" \
    "$(field edges <"$work/hull")" "$(field facets <"$work/hull")" "$(field audit <"$work/hull")"
}

# ask WANT QUERY A B OPTION...: checks the pair by both methods.
ask() {
  local want=$1 query=$2 flag
  shift 2
  printf '\n  %s\n' "$query"
  for flag in "" --textbook; do
    ctl check "$@" --axis --report $flag >"$work/answer"
    awk -F '  +' '{ value[$1] = $2 }
      END { printf "    %-16s  %-11s  %8s  axes tested: %s", value["method"], value["relation"],
                   value["time"], value["axes tested"]
            if (value["found at"] != "nowhere") printf "; found at %s", value["found at"]
            printf "\n" }' "$work/answer"
    expect "$want" "$(field relation <"$work/answer")"
  done
}

# turned_about NAME SHIFT: prints the pose of a copy of a hull, turned by half a turn about a
# vertical line. The line passes through the vertex of largest x, moved by the fraction SHIFT of the
# way to the middle of the hull. With SHIFT 0, hull and copy share exactly that vertex. With a small
# positive SHIFT they overlap; with a negative one there is a gap. Neither a half turn nor doubling
# a coordinate rounds, so the contact is exact.
turned_about() {
  ctl mesh "$1" | awk -v shift="$2" -v turn="$half_turn" '
    $1 == "v" { n++; x += $2; y += $3; if (n == 1 || $2 > vx) { vx = $2; vy = $3 } }
    END { printf "%s,%.17g,%.17g,0\n", turn, 2 * (vx + shift * (x / n - vx)),
                                             2 * (vy + shift * (y / n - vy)) }'
}

mesh_scenes() {
  heading "One mesh each: Spider and Wuson"
  register spider "$models/spider.obj"
  register wuson "$models/WusonOBJ.obj"

  heading "Two copies of Spider"
  ask SEPARATED "far apart?" spider spider --pose-b 1000,0,0
  ask OVERLAPPING "overlapping plainly?" spider spider --pose-b 10,5,0
  ask OVERLAPPING "overlapping barely, by one part in 10^12?" \
    spider spider --pose-b "$(turned_about spider 1e-12)"
  ask TOUCHING "exactly at the boundary, where they share one vertex?" \
    spider spider --pose-b "$(turned_about spider 0)"
  ask SEPARATED "apart by one part in 10^12?" spider spider --pose-b "$(turned_about spider -1e-12)"

  heading "Two copies of Wuson"
  ask TOUCHING "exactly at the boundary, where they share one vertex?" \
    wuson wuson --pose-b "$(turned_about wuson 0)"
  ask OVERLAPPING "the same place?" wuson wuson
}

generated_scenes() {
  heading "Two cubes, from a lattice of 27 points"
  ctl generate lattice 27 -o "$work/cube.xyz"
  register cube "$work/cube.xyz"
  ask TOUCHING "sharing a face?" cube cube --pose-b 2,0,0
  ask TOUCHING "sharing an edge?" cube cube --pose-b 2,2,0
  ask TOUCHING "sharing a corner?" cube cube --pose-b 2,2,2

  heading "3000 and 100 random points in a ball of radius 1"
  ctl generate ball 3000 --seed 1 -o "$work/ball3000.xyz"
  ctl generate ball 100 --seed 2 -o "$work/ball100.xyz"
  register ball3000 "$work/ball3000.xyz"
  register ball100 "$work/ball100.xyz"

  heading "The two random balls"
  ask SEPARATED "centers 2.5 apart?" ball3000 ball100 --pose-b 2.5,0,0
  ask OVERLAPPING "centers 1 apart?" ball3000 ball100 --pose-b 1,0,0
}

# A writer streams larger and larger balls into a hull while a reader checks it for a collision with
# a second hull. Each answer states the revision from which it was computed.
streaming_scene() {
  local radius revision last moves=0 points=$work/live.fifo
  heading "A live hull grows while it is queried: does it reach the ball at distance 6?"
  rm -f "$points"
  mkfifo "$points"
  ctl create live >/dev/null
  last=$(ctl get live | field revision)
  # Runs hullctl directly, not through ctl: the process itself must be stopped.
  "$build/bin/hullctl" --server "$address" append live - --chunk-points 500 \
    <"$points" >"$work/append" &
  writer_pid=$!
  exec 4>"$points"
  for radius in 1 2 3 4 5 6; do
    ctl generate ball 5000 --seed "$radius" --radius "$radius" >&4
    # The writer runs independently; continue after the hull has changed.
    for _ in {1..200}; do
      revision=$(ctl get live | field revision)
      ((revision > last)) && break
      sleep 0.05
    done
    ((revision > last)) && moves=$((moves + 1))
    last=$revision
    ctl check live ball100 --pose-b 6,0,0 >"$work/answer"
    printf '  points of radius <= %s on their way:  %-11s  at revision %s\n' "$radius" \
      "$(field relation <"$work/answer")" "$revision"
    ((radius > 2)) || expect SEPARATED "$(field relation <"$work/answer")"
  done
  exec 4>&-
  wait "$writer_pid" || expect "a writer that succeeds" "exit code $?"
  writer_pid=
  expect "6 changes seen" "$moves changes seen"
  ctl check live ball100 --pose-b 6,0,0 >"$work/answer"
  expect OVERLAPPING "$(field relation <"$work/answer")"
  printf '  all %s:  %s at revision %s\n' "$(field points <"$work/append")" \
    "$(field relation <"$work/answer")" "$(field revision <"$work/append")"
}

draw_picture() {
  heading "A page: points, mesh, and hull of a file; it needs no server"
  ctl view "$models/spider.obj" --html "$build/spider.html" >/dev/null
  echo "  $build/spider.html"
}

mkdir -p "$work"
echo "This takes 5 to 8 minutes the first time (2 cores), and seconds after that."
install_and_build
start_server
mesh_scenes
generated_scenes
streaming_scene
draw_picture
stop_everything
if ((wrong > 0)); then
  heading "$wrong answers were WRONG"
  exit 1
fi
heading "All answers are as expected"
cat <<END
  To open these scenes in a browser, where answers change as you drag hulls:
    $build/bin/hulld &
    $build/bin/hullctl view --demo
END
