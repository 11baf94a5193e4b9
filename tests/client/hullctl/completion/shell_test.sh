#!/bin/bash
# hullctl in its real environment: completed by a real shell, or prompting on a terminal.
#
#   shell_test.sh PROGRAMS bash|zsh|fish|terminal
#
# PROGRAMS: the directory of hulld and hullctl. Exit code 77: the shell is not installed.
set -uo pipefail

programs=$(cd "$1" && pwd) || exit 2
kind=$2
program=$kind
[[ $kind == terminal ]] && program=script
command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }

work=$(mktemp -d)
server=
trap '[[ -z $server ]] || { kill "$server"; wait "$server"; }; rm -rf "$work"' EXIT
export PATH=$programs:$PATH HOME=$work XDG_CONFIG_HOME=$work/config LC_ALL=C TERM=xterm
unset HULLCTL_SERVER HULLCTL_CONTEXT HULLD_TOKEN NO_COLOR
cd "$work" || exit 2

hulld --store memory --listen 127.0.0.1:0 2>hulld.log &
server=$!
until address=$(sed -n 's/.*listening on //p' hulld.log 2>/dev/null) && [[ -n $address ]]; do
  kill -0 "$server" || exit 1
  sleep 0.1
done
hullctl context add here --server "$address" >/dev/null
hullctl create arm/left >/dev/null
hullctl create box >/dev/null
echo "0 0 0" >points.xyz

failures=0
# expect LINE WANTED GOT: compares the candidates for a line.
expect() {
  [[ $2 == "$3" ]] && return 0
  echo "FAILED: $1"
  echo "  wanted: $2"
  echo "  got:    $3"
  failures=$((failures + 1))
}

# Lines, and the candidates for their last words.
cases() {
  expect "hullctl che" "check" "$(offers 'hullctl che')"
  expect "hullctl get a" "arm/left" "$(offers 'hullctl get a')"
  expect "hullctl check box b" "box" "$(offers 'hullctl check box b')"
  expect "hullctl list --output w" "wide" "$(offers 'hullctl list --output w')"
  expect "hullctl context use h" "here" "$(offers 'hullctl context use h')"
  expect "hullctl append box po" "points.xyz" "$(offers 'hullctl append box po')"
  expect "hullctl fly " "" "$(offers 'hullctl fly x')"
}

case $kind in
  bash)
    source <(hullctl completion bash)
    offers() {
      COMP_LINE=$1 COMP_POINT=${#1} COMPREPLY=()
      _hullctl
      echo "${COMPREPLY[*]}"
    }
    cases
    # Bash replaces only the part after the "=" or ":".
    expect "hullctl list --output=w" "wide" "$(offers 'hullctl list --output=w')"
    touch "my points.xyz"
    expect "a backslash" "my points.xyz" "$(offers 'hullctl append box my\ p')"
    expect "a blank after a backslash" "my points.xyz" "$(offers 'hullctl append box my\ ')"
    expect "a quote" "arm/left" "$(offers 'hullctl get "a')"
    expect "an alias" "arm/left" "$(offers 'h get a')"
    expect "an assignment in front" "arm/left" "$(offers 'HULLCTL_CONTEXT=here hullctl get a')"
    expect "a program that is typed with its path" "check" "$(offers "$programs/hullctl che")"
    ;;
  fish)
    offers() {
      fish -c 'hullctl completion fish | source; complete -C $argv[1]' "$1" | cut -f1 | paste -sd' '
    }
    cases
    expect "hullctl list --output=w" "--output=wide" "$(offers 'hullctl list --output=w')"
    ;;
  zsh)
    # A zsh pseudo-terminal: a tab completes the line and a key prints the result.
    cat >offers.zsh <<'EOF'
zmodload zsh/zpty
zpty -b shell zsh -f -i
zpty -w shell 'PS1=; autoload -U compinit; compinit -D; source <(hullctl completion zsh); unsetopt beep'
# The terminal echoes this text, so it must not resemble the output.
zpty -w shell 'show() { print -r -- "<""<$BUFFER>"">"; BUFFER=; zle accept-line }; zle -N show; bindkey "^X" show'
zpty -w shell 'print READ''Y'
zpty -r shell answer '*READY*'
zpty -w -n shell "$1"$'\t\x18'
zpty -r shell answer '*<<*>>*'
answer=${answer##*<<}
print -r -- ${answer%%>>*}
EOF
    offers() {
      local line
      line=$(timeout 300 zsh -f offers.zsh "$1")
      line=${line% }
      # A line without completion had no candidates.
      [[ $line == "$1" ]] || echo "${line##* }"
    }
    cases
    ;;
  terminal)
    # on_terminal INPUT COMMAND: the output on a terminal.
    on_terminal() { printf '%b' "$1" | timeout 300 script -qec "$2" /dev/null | tr -d '\r'; }
    contains() { [[ $3 == *"$2"* ]] || expect "$1" "...$2..." "$3"; }
    contains "the question before a delete" "Delete 1 hull (arm/left)? [y/N]" \
      "$(on_terminal 'n\n' 'hullctl delete --prefix arm/')"
    expect "a no" "arm/left" "$(hullctl list arm/ --output name)"
    contains "a yes" "arm/left deleted" "$(on_terminal 'y\n' 'hullctl delete --prefix arm/')"
    expect "a yes" "" "$(hullctl list arm/ --output name)"
    mkfifo points.xyz.pipe
    hullctl append big points.xyz.pipe --format xyz --create --chunk-points 1 --writer me 2>interrupted.txt &
    appending=$!
    exec 3>points.xyz.pipe
    echo "0 0 0" >&3
    until [[ $(hullctl get big 2>/dev/null) == *"1 received"* ]]; do
      kill -0 "$appending" || break
      sleep 0.1
    done
    kill -INT "$appending"
    exec 3>&-
    wait "$appending"
    expect "the exit code of an interrupted append" "1" "$?"
    expect "an interrupted append" \
      "hullctl: interrupted; 1 point committed to big; add --resume to the command to append the rest" \
      "$(cat interrupted.txt)"
    hullctl delete big >/dev/null
    hullctl create cell/stray >/dev/null
    printf 'prefix: cell/\nhulls:\n  table: {box: [1, 1, 1]}\n' >cell.yaml
    contains "the query before a prune" "Delete 1 hull (cell/stray)? [y/N]" \
      "$(on_terminal 'n\n' 'hullctl scene apply cell.yaml --prune')"
    expect "a no to a prune" "cell/stray" "$(hullctl list cell/ --output name)"
    contains "a yes to a prune" "cell/stray" "$(on_terminal 'y\n' 'hullctl scene apply cell.yaml --prune')"
    expect "a yes to a prune" "cell/table" "$(hullctl list cell/ --output name)"
    hullctl delete cell/table >/dev/null
    contains "colors" $'\e[1mHULL\e[0m' "$(on_terminal '' 'hullctl list')"
    expect "NO_COLOR" "0" "$(NO_COLOR=1 on_terminal '' 'hullctl list' | grep -c $'\e\\[1m')"
    expect "a pipe" "0" "$(hullctl list | grep -c $'\e')"
    ;;
esac
echo "$failures failures"
((failures == 0))
