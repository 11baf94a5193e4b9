#!/bin/bash
# Checks the pages statically: links lead to existing files and headings, paths in `backticks`
# exist, the first page is short, and the tables of settings, errors, and commands are complete.
#
#   bash tests/pages/check_pages.sh PROGRAMS
#
# PROGRAMS: the directory of hulld and hullctl.
set -uo pipefail
programs=$(cd "$1" && pwd) || exit 2
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 2
export LC_ALL=C

readonly max_readme_bytes=14336
problems=0
problem() {
  echo "$*"
  problems=$((problems + 1))
}

pages() { find . \( -name build -o -name .git \) -prune -o -name '*.md' -print | sort; }

# text PAGE: prints its lines without code blocks.
text() { awk '/^ *```/ { inside = !inside; next } !inside' "$1"; }

# anchors PAGE: prints the link anchors of its headings: lower case, no punctuation, hyphens for
# spaces.
anchors() {
  text "$1" | sed -n 's/^#\{1,6\} *//p' | tr '[:upper:]' '[:lower:]' | sed 's/[^a-z0-9 _-]//g; s/ /-/g'
}

check_links() {
  local page=$1 link path anchor
  while read -r link; do
    [[ $link =~ ^(https?|mailto): ]] && continue
    path=${link%%#*}
    anchor=
    [[ $link == *#* ]] && anchor=${link#*#}
    if [[ -n $path && ! -e $(dirname "$page")/$path ]]; then
      problem "$page: the link $link leads nowhere"
      continue
    fi
    [[ -z $anchor ]] && continue
    anchors "${path:+$(dirname "$page")/}${path:-$page}" | grep -qxF -- "$anchor" ||
      problem "$page: there is no heading for the link $link"
  done < <(text "$page" | grep -oE '\]\([^) ]+\)' | sed 's/^](//; s/)$//')
}

check_paths() {
  local page=$1 path
  while read -r path; do
    compgen -G "$path" >/dev/null || problem "$page: $path does not exist"
  done < <(text "$page" | grep -oE '`(core|server|client|docker|proto|tests)/[A-Za-z0-9_./*-]*`' | tr -d '`')
}

# check_complete PAGE WHAT LIST...: every item of the list is in the first column of a table of the
# page.
check_complete() {
  local page=$1 what=$2 name
  shift 2
  for name in "$@"; do
    grep -qE "^\|[^|]*\`$name[\` ]" "$page" || problem "$page: the tables lack the $what $name"
  done
}

# Crontab blocks contain five time fields and a command, which cron cuts at a bare % and passes to
# sh. Such a line in another kind of block would escape the check.
check_crontabs() {
  local page=$1 language line command
  while IFS=$'\t' read -r language line; do
    if ! [[ $line =~ ^([-0-9*,/]+[[:blank:]]+){5}([[:alpha:]/].*)$ ]]; then
      [[ $language != crontab || -z $line || $line == \#* ]] ||
        problem "$page: this is no line of a crontab: $line"
      continue
    fi
    command=${BASH_REMATCH[2]//\\%/}
    [[ $language == crontab ]] || problem "$page: put this line into a block of crontab: $line"
    [[ $command != *%* ]] || problem "$page: cron cuts this line at its first bare %: $line"
    sh -n <<<"$command" 2>/dev/null || problem "$page: sh cannot parse the command of: $line"
  done < <(awk '/^ *```/ { language = inside ? "" : substr($1, 4); inside = !inside; next }
    inside { print (language == "" ? "text" : language) "\t" $0 }' "$page")
}

for page in $(pages); do
  check_links "$page"
  check_paths "$page"
  check_crontabs "$page"
done

bytes=$(wc -c <README.md)
((bytes <= max_readme_bytes)) || problem "README.md has $bytes bytes; the limit is $max_readme_bytes"

mapfile -t flags < <("$programs/hulld" --help | grep -oE '^  (-[a-z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+')
((${#flags[@]} > 20)) || problem "hulld --help names no flags"
for flag in "${flags[@]}"; do
  case $flag in
    --help | --version | --config | --check-config) ;;
    *) check_complete server/REFERENCE.md setting "$flag" ;;
  esac
done
while read -r flag; do
  [[ " ${flags[*]} " == *" $flag "* ]] || problem "server/REFERENCE.md: hulld has no $flag"
done < <(sed -n '/^## Settings/,/^## Errors/p' server/REFERENCE.md | grep -oE '^\| `--[a-z-]+' | grep -oE -- '--[a-z-]+')

while read -r reason; do
  grep -qw "$reason" server/REFERENCE.md || problem "server/REFERENCE.md: the errors lack the reason $reason"
done < <(sed -nE 's/^ *ERROR_REASON_([A-Z_]+) = [1-9][0-9]*;$/\1/p' proto/hulld/v1/error.proto)

mapfile -t commands < <("$programs/hullctl" --help | sed '/^Options/,$d' | sed -nE 's/^  ([a-z]+) .*/\1/p')
((${#commands[@]} > 10)) || problem "hullctl --help names no commands"
check_complete client/README.md command "${commands[@]}"

echo "$(pages | wc -l) pages, $problems problems"
((problems == 0))
