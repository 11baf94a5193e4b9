#!/bin/bash
# Builds hulld and runs its tests, as continuous integration does: presets release and asan-ubsan.
#
#   bash tests/run.sh [--release-only] [--tsan] [--fuzz] [--arm64] [--tidy] [--no-install]
#
# --tsan runs, instead, the tests of what uses threads under ThreadSanitizer (clang; preset tsan);
# --fuzz runs each fuzzer for a fixed number of inputs under libFuzzer (clang; preset fuzz);
# --arm64 cross-compiles core and the test of digests for 64-bit ARM and runs it by qemu;
# --tidy runs clang-tidy over what changed (tests/tidy.sh).
#
# On a bare Debian 12 it first installs what docker/packages.txt lists (as root); with everything
# there it asks apt for nothing. Builds into build/. Ends with a summary; fails when any part did.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2

presets=(release asan-ubsan)
install=yes
tidy=no
sections=(build test models)
for option in "$@"; do
  case $option in
    --release-only) presets=(release) ;;
    --tsan) presets=(tsan) sections+=(tsan) ;;
    --fuzz) presets=(fuzz) sections+=(fuzz) ;;
    --arm64) presets=(arm64) sections+=(arm64) ;;
    --tidy) presets=() sections+=(tidy) tidy=yes ;;
    --no-install) install=no ;;
    --help)
      sed -n '2,12s/^# \{0,1\}//p' tests/run.sh
      exit 0
      ;;
    *)
      echo "tests/run.sh: unknown option $option; see --help" >&2
      exit 2
      ;;
  esac
done

failed=0
summary=()

# run_part NAME COMMAND...: runs one part under a heading and notes its outcome and its time.
run_part() {
  local name=$1 start=$SECONDS outcome=ok code=0
  shift
  printf '\n==== %s\n' "$name"
  "$@" || { code=$?; outcome=FAILED; failed=1; }
  summary+=("$(printf '%-24s %-6s %4d s' "$name" "$outcome" $((SECONDS - start)))")
  return $code
}

check_format() {
  # Another version would format otherwise.
  if ! command -v clang-format-14 >/dev/null; then
    echo "skipped: clang-format-14 is not installed"
    return 0
  fi
  find core server client tests \( -name '*.cc' -o -name '*.h' -o -name '*.js' \) -print0 |
    xargs -0 -r clang-format-14 --dry-run -Werror ||
    { echo "Please run clang-format-14 -i on the files above."; return 1; }
}

configure_and_build() {
  cmake --preset "$1" && cmake --build --preset "$1" --parallel "$jobs"
}

# A compiler of this code may take 1.5 GiB, so memory bounds the number of jobs too.
available_kib=$(awk '/^MemAvailable:/ { print $2 }' /proc/meminfo 2>/dev/null || true)
jobs=$(nproc)
by_memory=$((${available_kib:-1572864} / 1572864))
((jobs > by_memory)) && jobs=$((by_memory > 0 ? by_memory : 1))

if [[ $install == yes ]]; then
  run_part "packages" bash docker/packages.sh install "${sections[@]}" || exit 1
fi
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
  # Without these it keeps nothing that starts with a precompiled header.
  export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}
  # Precompiled headers have 400 MB: hashed once, not for each file, which took 0.4 s.
  export CCACHE_INODECACHE=${CCACHE_INODECACHE:-1}
  # A clone in another folder finds what was compiled in this one. Debug information may then name
  # that one's folder.
  export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
fi

run_part "format" check_format
[[ $tidy == no ]] || run_part "tidy" bash tests/tidy.sh
for preset in "${presets[@]}"; do
  run_part "$preset: build" configure_and_build "$preset" &&
    run_part "$preset: tests" ctest --preset "$preset" --parallel "$jobs"
done

printf '\n==== summary\n'
printf '%s\n' "${summary[@]}"
((failed == 0)) && echo "All parts passed." || echo "Some parts FAILED: see above."
exit $failed
