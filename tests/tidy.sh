#!/bin/bash
# Runs clang-tidy over the changed C++ files, each parsed by itself, without precompiled headers.
#
#   bash tests/tidy.sh [BASE | --all]
#
# BASE: the commit to compare with; by default the merge base with origin/main, or the parent of
# HEAD if that is HEAD itself. Includes uncommitted changes. For a changed header, checks the source
# of the same name in its folder. Requires the packages in docker/packages.txt under [build],
# [test], and [tidy].
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! command -v clang-tidy-14 >/dev/null; then
  echo "skipped: clang-tidy-14 is not installed"
  exit 0
fi

changed_since() {
  git diff --name-only --diff-filter=d "$1" -- core server client tests
  git ls-files --others --exclude-standard -- core server client tests
}

# Omits files outside the preset's build, such as tests/bench and the fuzzers.
list_files() {
  local base=${1-}
  if [[ $base == --all ]]; then
    git ls-files 'core/*.cc' 'server/*.cc' 'client/*.cc' 'tests/*.cc'
    return
  fi
  if [[ -z $base ]]; then
    base=$(git merge-base HEAD origin/main 2>/dev/null || true)
    if [[ -z $base || $base == $(git rev-parse HEAD) ]]; then base=$(git rev-parse -q --verify HEAD~1 || true); fi
    [[ -n $base ]] || { echo "tests/tidy.sh: no commit to compare with" >&2; return 0; }
  fi
  local file
  changed_since "$base" | while read -r file; do
    case $file in
      *.cc) echo "$file" ;;
      *.h) [[ ! -f ${file%.h}.cc ]] || echo "${file%.h}.cc" ;;
    esac
  done | sort -u
}

cmake --preset tidy >/dev/null
cmake --build build/tidy --target hulld_proto_sources >/dev/null
# The registry is compiled a second time in tests/server/schedules. Omits that one, which needs g++:
# clang 14 lacks std::source_location.
python3 - build/tidy/compile_commands.json <<'PYTHON'
import json, sys
with open(sys.argv[1]) as file:
    commands = [each for each in json.load(file) if "/tests/server/schedules/seam" not in each["command"]]
with open(sys.argv[1], "w") as file:
    json.dump(commands, file, indent=0)
PYTHON
known=$(grep -o "\"file\": \"$PWD/[^\"]*" build/tidy/compile_commands.json | sed "s|.*\"$PWD/||" | sort -u)
files=$(comm -12 <(list_files "$@" | sort -u) <(echo "$known"))
if [[ -z $files ]]; then
  echo "no changed file to check"
  exit 0
fi
echo "$files" | wc -l | sed 's/$/ files/'
# Warnings are errors; the summary of suppressed warnings in library headers is noise.
echo "$files" | xargs -P "$(nproc)" -n 4 clang-tidy-14 -p build/tidy --quiet --warnings-as-errors='*' 2> >(grep -v -e 'warnings generated' -e '^Suppressed' -e '^Use -header-filter' >&2)
