#!/bin/bash
# Executes the instructions of a page and compares the output with the page.
#
#   bash tests/pages/run_page.sh PAGE PROGRAMS WORK
#
# PROGRAMS: the directory of hulld and hullctl, which is added to PATH. WORK: a directory for the
# page's files, recreated by each run. Commands are in "console" blocks, after "$ ", and in "sh"
# blocks; page_steps.awk defines how a page marks a block as a file or as not run. A command that
# starts a server is left running until the next one starts, on a free port that hullctl finds in
# HULLCTL_SERVER. A console command may fail if the page shows its output in that case. Exit code
# 77: a requirement of the page is missing.
set -uo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
page=$1
programs=$(cd "$2" && pwd) || exit 2
work=$3

models=/usr/share/assimp/models
if grep -q "$models" "$page" && [[ ! -d $models ]]; then
  echo "skipped: $models is missing (package assimp-testmodels)"
  exit 77
fi

for program in hulld hullctl; do
  [[ -x $programs/$program ]] || { echo "$programs/$program is not a program"; exit 2; }
done

rm -rf "$work" && mkdir -p "$work/steps" "$work/home" || exit 2
work=$(cd "$work" && pwd)
(cd "$(dirname "$page")" && awk -v out="$work/steps" -f "$here/page_steps.awk" "$(basename "$page")") || exit 2
cd "$work/home" || exit 2

export LC_ALL=C HOME=$work/home XDG_STATE_HOME=$work/home/state PATH=$programs:$PATH
export HULLD_LISTEN=127.0.0.1:0
unset HULLCTL_SERVER HULLCTL_CONTEXT HULLD_TOKEN XDG_CONFIG_HOME

server=
failures=0
ran=0

stop_server() {
  [[ -n $server ]] || return 0
  kill "$server" 2>/dev/null
  wait "$server" 2>/dev/null
  exec {server_output}<&-
  server=
}
trap stop_server EXIT

fail() {
  echo "FAILED $(cat "$1.place"): $(head -1 "$1.command" 2>/dev/null || echo "a block of sh")"
  cat
  failures=$((failures + 1))
}

# is_server COMMAND: true if it runs until it is stopped.
is_server() {
  [[ $1 =~ ^hulld( |$) && ! $1 =~ (--check-config|--help|--version|hulld doctor|\|) ]]
}

# start_server COMMAND OUTPUT: returns when the server listens or has ended.
start_server() {
  local line
  stop_server
  eval "exec {server_output}< <(exec $1 2>&1)"
  server=$!
  : >"$2"
  while read -r -t 120 line <&"$server_output"; do
    echo "$line" >>"$2"
    if [[ $line =~ listening\ on\ (.*)$ ]]; then
      export HULLCTL_SERVER=${BASH_REMATCH[1]}
      return 0
    fi
  done
  return 1
}

for place in "$work"/steps/*.place; do
  [[ -e $place ]] || continue  # A page without steps.
  step=${place%.place}
  if [[ -f $step.file ]]; then
    mkdir -p "$(dirname "$(head -1 "$step.file")")"
    tail -n +2 "$step.file" >"$(head -1 "$step.file")"
  elif [[ -f $step.skipped ]]; then
    echo "not run, $(cat "$place"): $(cat "$step.skipped")"
  elif [[ -f $step.script ]]; then
    ran=$((ran + 1))
    bash -eu "$step.script" >"$step.actual" 2>&1 </dev/null || fail "$step" <"$step.actual"
  else
    ran=$((ran + 1))
    touch "$step.expected"
    # Pages use the default port; replaces it with the port of this run.
    command=$(sed "s/127\.0\.0\.1:50551/${HULLCTL_SERVER:-127.0.0.1:50551}/g" "$step.command")
    if is_server "$command"; then
      start_server "$command" "$step.actual"
    else
      bash -c "$command" >"$step.actual" 2>&1 </dev/null
    fi
    code=$?
    difference=$(awk -f "$here/compare_output.awk" "$step.expected" "$step.actual") ||
      fail "$step" <<<"$difference"
    if ((code != 0)) && [[ ! -s $step.expected ]]; then
      fail "$step" <<<"  it ended with $code, of which the page says nothing"
    fi
  fi
done

echo "$ran commands of $page, $failures failed"
((failures == 0))
