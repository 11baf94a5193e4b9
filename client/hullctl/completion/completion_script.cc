#include "client/hullctl/completion/completion.h"

namespace hulld {
namespace {

// Bash also splits words at "=" and ":" and replaces only the last piece. So the script takes the
// words from the line itself, and cuts the text before the last piece off each candidate.
constexpr char kBash[] =
    R"sh(# bash completion for hullctl. Read it with: source <(hullctl completion bash)
_hullctl() {
  local line=${COMP_LINE:0:COMP_POINT} words=() reply=() program candidate directive last cut=
  # Without -r, so that the words have no backslashes.
  read -a words <<<"$line"
  [[ $line == *[^\\][[:space:]] ]] && words+=("")
  # Assignments in front, as in "HULLCTL_CONTEXT=cell-3 hullctl list".
  while [[ ${words[0]} == *=* ]]; do words=("${words[@]:1}"); done
  # An alias is not known by its name.
  program=${words[0]/#\~/$HOME}
  type -P "$program" >/dev/null || program=hullctl
  last=${words[${#words[@]} - 1]#[\'\"]}
  mapfile -t reply < <("$program" __complete "${words[@]:1:${#words[@]}-2}" "$last" 2>/dev/null)
  ((${#reply[@]} > 0)) || return 0
  directive=${reply[${#reply[@]} - 1]}
  unset "reply[${#reply[@]}-1]"
  [[ $last == *[:=]* ]] && cut=${last%"${last##*[:=]}"}
  COMPREPLY=()
  for candidate in "${reply[@]}"; do
    candidate=${candidate%%$'\t'*}
    COMPREPLY+=("${candidate#"$cut"}")
  done
  case $directive in
    :files) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "${last#"$cut"}") ;;
    :directories) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -d -- "${last#"$cut"}") ;;
  esac
  [[ $directive != : ]] && compopt -o filenames 2>/dev/null
  # A part of a name, up to its next "/", goes on.
  [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == */ ]] && compopt -o nospace 2>/dev/null
  return 0
}
complete -F _hullctl hullctl
)sh";

constexpr char kZsh[] = R"sh(#compdef hullctl
# zsh completion for hullctl: a file _hullctl in a folder of $fpath, or
# source <(hullctl completion zsh)
_hullctl() {
  local -a reply described parts
  local line directive text program=${~words[1]}
  # An alias is not known by its name.
  whence -p -- "$program" >/dev/null || program=hullctl
  reply=("${(@f)$("$program" __complete "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)}")
  directive=${reply[-1]}
  for line in "${(@)reply[1,-2]}"; do
    text=${line%%$'\t'*}
    if [[ $text == */ ]]; then
      parts+=("$text")
    elif [[ $line == *$'\t'?* ]]; then
      described+=("${text//:/\\:}:${line#*$'\t'}")
    else
      described+=("${text//:/\\:}")
    fi
  done
  (( ${#described} )) && _describe -V hullctl described
  (( ${#parts} )) && compadd -S '' -- "${parts[@]}"
  case $directive in
    :files) _files ;;
    :directories) _files -/ ;;
  esac
}
if [[ $funcstack[1] == _hullctl ]]; then
  _hullctl "$@"
else
  compdef _hullctl hullctl
fi
)sh";

constexpr char kFish[] =
    R"sh(# fish completion for hullctl. Read it with: hullctl completion fish | source
function __hullctl_complete
    set -l words (commandline -opc)
    set -l last (commandline -ct)
    set -l program $words[1]
    # An alias is not known by its name.
    command -q $program; or set program hullctl
    set -l reply ($program __complete $words[2..-1] "$last" 2>/dev/null)
    test (count $reply) -gt 0; or return
    for line in $reply[1..-2]
        test -n "$line"; and echo $line
    end
    switch $reply[-1]
        case :files
            __fish_complete_path "$last"
        case :directories
            __fish_complete_directories "$last"
    end
end
complete -c hullctl -f -a '(__hullctl_complete)'
)sh";

}  // namespace

std::string CompletionScript(const std::string& shell) {
  return shell == "bash" ? kBash : shell == "zsh" ? kZsh : kFish;
}

}  // namespace hulld
