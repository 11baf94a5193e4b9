#!/bin/bash
# Reads docker/packages.txt.
#
#   packages.sh list SECTION...      prints the packages of the sections, one per line
#   packages.sh missing SECTION...   prints the packages that are not installed
#   packages.sh install SECTION...   installs them; does not call apt if none is missing
set -euo pipefail

list=$(dirname "${BASH_SOURCE[0]}")/packages.txt

list_packages() {
  local section
  for section in "$@"; do
    if ! grep -qx "\[$section\]" "$list"; then
      echo "packages.sh: no section [$section] in $list" >&2
      return 2
    fi
    awk -v wanted="[$section]" '/^\[/ { inside = ($0 == wanted); next }
                                inside && NF && !/^#/ { print $1 }' "$list"
  done
}

list_missing() {
  local packages package
  packages=$(list_packages "$@")
  for package in $packages; do
    # One line per architecture.
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed ||
      echo "$package"
  done
}

install_missing() {
  local missing
  missing=$(list_missing "$@" | tr '\n' ' ')
  [[ -n $missing ]] || return 0
  if ((EUID != 0)); then
    echo "These Debian packages are missing, and only root can install them. Please run:" >&2
    echo "  sudo apt-get install --no-install-recommends $missing" >&2
    return 1
  fi
  export DEBIAN_FRONTEND=noninteractive
  # Packages of another architecture are named name:architecture.
  [[ $missing != *:arm64* ]] || dpkg --add-architecture arm64
  apt-get -q update
  # shellcheck disable=SC2086  # One word per package.
  apt-get -q install -y --no-install-recommends $missing
}

command=${1-}
shift || true
case $command in
  list) list_packages "$@" ;;
  missing) list_missing "$@" ;;
  install) install_missing "$@" ;;
  *)
    sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
    ;;
esac
