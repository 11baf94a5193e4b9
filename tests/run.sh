#!/bin/bash
# Builds hulld and tests it.
#
#   bash tests/run.sh            release build; every test except the long ones
#   bash tests/run.sh --quick    core without proofs and slow suites, and one query to a server
#   bash tests/run.sh --ci       the checks of continuous integration: release and asan-ubsan with the
#                                long tests, mutants, self-contained headers, clang-tidy over the
#                                last change, and the Debian packages
#
# Single checks: --tsan (ThreadSanitizer over threaded code without gRPC), --fuzz (each fuzzer for a
# fixed number of inputs under libFuzzer), --arm64 (core's digests by emulation), and --tidy
# (clang-tidy over the last change). --no-install skips apt.
#
# Installs the packages in docker/packages.txt (as root, on Debian 12), builds into build/, and ends
# with a summary of parts and times.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 2

mode=default
install=yes
for option in "$@"; do
  case $option in
    --quick | --ci | --tsan | --fuzz | --arm64 | --tidy) mode=${option#--} ;;
    --no-install) install=no ;;
    --help)
      sed -n '2,16s/^# \{0,1\}//p' tests/run.sh
      exit 0
      ;;
    *)
      echo "tests/run.sh: unknown option $option; see --help" >&2
      exit 2
      ;;
  esac
done
# Packages that the tests need after core's are installed during the build.
sections=(build test-core)
later_sections=()
case $mode in
  quick) ;;
  default) later_sections=(test models) ;;
  ci) later_sections=(test models package tidy) ;;
  *) sections+=(test models "$mode") ;;
esac

failed=0
summary=()

# run_part NAME COMMAND...: runs one part under a heading and records its outcome and time.
run_part() {
  local name=$1 start=$SECONDS outcome=ok code=0
  shift
  printf '\n==== %s\n' "$name"
  "$@" || code=$?
  case $code in
    0) ;;
    77) outcome=skipped ;;
    *) outcome=FAILED failed=1 ;;
  esac
  summary+=("$(printf '%-28s %-7s %4d s' "$name" "$outcome" $((SECONDS - start)))")
  return $code
}

check_format() {
  # Versions of clang-format differ in their output.
  command -v clang-format-14 >/dev/null || { echo "skipped: clang-format-14 is not installed"; return 77; }
  find proto core server client tests \( -name '*.cc' -o -name '*.h' -o -name '*.js' -o -name '*.proto' \) -print0 |
    xargs -0 -r clang-format-14 --dry-run -Werror ||
    { echo "Run clang-format-14 -i on the files above."; return 1; }
}

# build PRESET TARGET...: builds once more if the compiler itself crashes, as g++ 12 rarely does on a
# file with a precompiled header.
build() {
  local code=0
  for _ in first second; do
    ${lower_priority-} cmake --build --preset "$1" --parallel "$jobs" --target "${@:2}" 2>&1 | tee build/build.log
    code=${PIPESTATUS[0]}
    ((code != 0)) && grep -q 'internal compiler error' build/build.log || break
  done
  return "$code"
}

# run_tests PRESET CTEST_OPTION...: ends with the skipped tests and the ten slowest suites.
run_tests() {
  local preset=$1 code=0
  shift
  # Many tests wait for a disk or another process: with one more job than processors, a third of the
  # processor time was idle.
  ctest --preset "$preset" --parallel $((2 * jobs)) "$@" | tee "build/$preset/ctest.log" || code=1
  sed -n -E 's/^(\[  SKIPPED \] [^ ]+)( \([0-9]+ ms\))?$/\1/p' "build/$preset/Testing/Temporary/LastTest.log" | sort -u
  echo "slowest:"
  sed -n -E 's/^ *[0-9]+\/[0-9]+ Test +#[0-9]+: ([^ ]+) .* ([0-9.]+) sec.*/\2 s  \1/p' "build/$preset/ctest.log" |
    sort -rn | sed -n '1,10s/^/  /p'
  return $code
}

check_includes() {
  cmake --install build/release --component devel --prefix build/includes >/dev/null &&
    python3 tests/includes.py build/includes/include/hulld
}

# Tests leave a third of the processor idle, so a second check runs concurrently. in_background
# NAME COMMAND... starts a command; finish NAME waits for it, prints its output, and returns its exit code.
declare -A background
in_background() {
  "${@:2}" >"build/$1.log" 2>&1 &
  background[$1]=$!
}
finish() {
  local code=0
  [[ -n ${background[$1]-} ]] || { echo "not started, because the build failed"; return 1; }
  wait "${background[$1]}" || code=$?
  cat "build/$1.log"
  return $code
}

# One compiler process may use 1.5 GiB, so memory also limits the number of jobs.
available_kib=$(awk '/^MemAvailable:/ { print $2 }' /proc/meminfo 2>/dev/null || true)
jobs=$(nproc)
by_memory=$((${available_kib:-1572864} / 1572864))
((jobs > by_memory)) && jobs=$((by_memory > 0 ? by_memory : 1))

if [[ $install == yes ]]; then
  # Only root can install packages; for other users, all missing packages are listed at once.
  ((EUID == 0)) || sections+=("${later_sections[@]}")
  run_part "packages" bash docker/packages.sh install "${sections[@]}" || exit 1
fi
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
  # Without CCACHE_SLOPPINESS, ccache caches no file that uses a precompiled header; without
  # CCACHE_INODECACHE, it reads these headers, 400 MB, for each file.
  export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}
  export CCACHE_INODECACHE=${CCACHE_INODECACHE:-1}
  # Clones in other folders share the entries; their debug information may then name this folder.
  export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
fi

# The cheap checks come first, so that most failures show within minutes.
readonly core_labels='core|core-threads|digest-threads|proof|proto'
core_targets=(core_test core_threads_test digest_threads_test)
readonly rare='long|mutant'

build_preset() {  # build_preset PRESET TARGET...: tests core before it builds the rest
  local preset=$1
  shift
  run_part "$preset: configure" cmake --preset "$preset" ${configure_option-} || return
  run_part "$preset: core build" build "$preset" "${core_targets[@]}" &&
    run_part "$preset: core tests" run_tests "$preset" -L "^($core_labels)$" -LE "^($excluded)$"
  run_part "$preset: build" build "$preset" "$@"
}
test_rest() { run_tests "$1" -LE "^($core_labels|$excluded)$"; }

if [[ $mode != tidy ]]; then
  run_part "format" check_format
  run_part "prose" python3 tests/prose.py
fi
if [[ $install == yes && ${#later_sections[@]} -gt 0 ]]; then
  mkdir -p build
  in_background packages bash docker/packages.sh install "${later_sections[@]}"
fi
finish_packages() { [[ -z ${background[packages]-} ]] || run_part "more packages" finish packages; }
case $mode in
  quick)
    run_part "configure" cmake --preset quick &&
      run_part "build" build quick "${core_targets[@]}" hulld smoke_client &&
      run_part "tests" run_tests quick -L '^(core|core-threads|digest-threads|smoke)$' -LE "^(slow|proof|$rare)$"
    ;;
  default)
    core_targets+=(print_constants proto_test)
    excluded=$rare
    release=failed
    build_preset release all && release=built
    finish_packages && [[ $release == built ]] && run_part "release: tests" test_rest release
    ;;
  ci)
    excluded=none
    asan=failed release=failed
    build_preset asan-ubsan all && asan=built
    finish_packages && [[ $asan == built ]] && in_background asan-ubsan test_rest asan-ubsan
    core_targets+=(print_constants proto_test)
    lower_priority=nice configure_option=-DHULLD_BUILD_MUTANTS=ON build_preset release all && release=built
    run_part "asan-ubsan: tests" finish asan-ubsan
    if [[ $release == built ]]; then
      in_background includes check_includes
      in_background debian nice bash -c 'bash docker/debian/build.sh && bash tests/install/packages.sh build/release/packages'
      run_part "release: tests" test_rest release
      run_part "includes" finish includes
      run_part "Debian packages" finish debian
    fi
    run_part "tidy" bash tests/tidy.sh
    ;;
  tidy) run_part "tidy" bash tests/tidy.sh ;;
  *)
    run_part "$mode: configure" cmake --preset "$mode" &&
      run_part "$mode: build" cmake --build --preset "$mode" --parallel "$jobs" &&
      run_part "$mode: tests" run_tests "$mode"
    ;;
esac

printf '\n==== summary\n'
printf '%s\n' "${summary[@]}"
((failed == 0)) && echo "All parts passed." || echo "Some parts FAILED: see above."
exit $failed
