#!/bin/bash
# Keeps the tables of measurements in the pages equal to the rows in tests/bench/results/.
#
#   tables.sh --write [MACHINE]   writes them into the pages
#   tables.sh --check [MACHINE]   fails with a message if a page, or the chart of the summary, differs
#   tables.sh TABLE [MACHINE]     prints one
#
# MACHINE names the files, as in hull_build_MACHINE.csv; epyc_gcc12 by default. In a page, a table
# is between <!-- table NAME --> and <!-- end of table -->; tables.awk defines the names. A table of
# another machine is marked <!-- table NAME of MACHINE -->.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
export LC_ALL=C

what=${1:---help}
machine=${2:-epyc_gcc12}

# Pages, and the path of results/ relative to each.
readonly pages=(../../README.md README.md)
results_of() { [[ $1 == README.md ]] && echo results/ || echo tests/bench/results/; }

# made_table TABLE PAGE [MACHINE]
made_table() {
  awk -v table="$1" -v machine="${3:-$machine}" -v results="$(results_of "$2")" -f tables.awk </dev/null
}

# rewritten PAGE: prints the page with its tables regenerated.
rewritten() {
  local page=$1 line
  while IFS= read -r line; do
    if [[ $line =~ ^'<!-- table '([a-z-]+)(' of '([a-z0-9_]+))?' -->'$ ]]; then
      printf '%s\n' "$line"
      made_table "${BASH_REMATCH[1]}" "$page" "${BASH_REMATCH[3]}"
      while IFS= read -r line && [[ $line != '<!-- end of table -->' ]]; do :; done
    fi
    printf '%s\n' "$line"
  done <"$page"
}

case $what in
  --write)
    for page in "${pages[@]}"; do
      rewritten "$page" >"$page.new"
      mv "$page.new" "$page"
    done
    ;;
  --check)
    different=0
    for page in "${pages[@]}"; do
      rewritten "$page" | diff -u "$page" - || different=1
    done
    ((different == 0)) || echo "Please run: bash tests/bench/tables.sh --write"
    bash plot_summary.sh "$machine" check || different=1
    exit $different
    ;;
  --help) sed -n '2,10s/^# \{0,1\}//p' tables.sh ;;
  *) made_table "$what" README.md ;;
esac
