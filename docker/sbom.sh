#!/bin/bash
# Prints the contents of an image as SPDX 2.3, in JSON: every Debian package installed in it and,
# for each program, the packages of the shared libraries that it links.
#
#   sbom.sh [--compiled-in FILE] PROGRAM...
#
# FILE: lines of "package version" for the headers and static libraries compiled into the programs;
# sbom.sh --versions SECTION... prints such lines for sections of packages.txt. SOURCE_DATE_EPOCH,
# if set, is the creation time of the document.
set -euo pipefail

here=$(dirname "${BASH_SOURCE[0]}")

if [[ ${1-} == --versions ]]; then
  shift
  # One line per package, even if it is installed for two architectures.
  bash "$here/packages.sh" list "$@" | xargs dpkg-query -W -f '${Package} ${Version}\n' | sort -u
  exit
fi

compiled_in=/dev/null
if [[ ${1-} == --compiled-in ]]; then
  compiled_in=$2
  shift 2
fi
if (($# == 0)); then
  sed -n '2,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
  exit 2
fi
programs=("$@")

# The functions below return their result in REPLY: an image holds many packages, and starting a
# process for each is slow.
quote() {  # a JSON string
  REPLY=${1//\\/\\\\}
  REPLY=${REPLY//\"/\\\"}
  REPLY="\"${REPLY//[$'\t\r\n']/ }\""
}

# spdx_id PREFIX NAME: sets REPLY to an ID of letters, digits, dots, and dashes, the only characters
# allowed.
spdx_id() {
  REPLY=${2//+/.plus}
  REPLY=SPDXRef-$1-${REPLY//[^A-Za-z0-9.-]/-}
}

# License names in Debian's copyright files, if these have the machine-readable format.
declare -A licenses_of
read_licenses() {
  local name licenses
  while IFS=$'\t' read -r name licenses; do
    licenses_of[$name]=$licenses
  done < <(awk '/^License: */ {
      sub(/^License: */, "")
      split(FILENAME, part, "/")
      if ($0 == "" || seen[part[5], $0]++) next
      all[part[5]] = all[part[5]] (part[5] in all ? "; " : "") $0
    }
    END { for (name in all) print name "\t" all[name] }' /usr/share/doc/*/copyright)
}

# Packages of the libraries that a program links. One file can have several names (with /usr,
# without it, symbolic links), and dpkg knows only one of them.
packages_of_program() {
  local library real owner names=()
  local -A owner_of
  mapfile -t libraries < <(ldd "$1" | awk '/=> \// { print $3 } /^\t\// { print $1 }')
  for library in "${libraries[@]}"; do
    real=$(realpath "$library")
    names+=("$library" "/usr$library" "${library#/usr}" "$real" "/usr$real" "${real#/usr}")
  done
  while IFS= read -r owner; do
    [[ $owner == diversion* ]] || owner_of[$(realpath "${owner#*: }")]=${owner%%:*}
  done < <(dpkg -S "${names[@]}" 2>/dev/null)
  for library in "${libraries[@]}"; do
    real=$(realpath "$library")
    if [[ -z ${owner_of[$real]-} ]]; then
      echo "sbom.sh: no package holds $library" >&2
      return 1
    fi
    echo "${owner_of[$real]}"
  done | sort -u
}

# package ID NAME VERSION MORE [LICENSE]: MORE holds members of the JSON object, each ending in a
# comma, or nothing; LICENSE is given for the project's own packages.
package() {
  quote "$2"
  printf '%s    {"SPDXID": "%s", "name": %s,' "$separator" "$1" "$REPLY"
  quote "$3"
  printf ' "versionInfo": %s, "downloadLocation": "NOASSERTION", "filesAnalyzed": false,%s' \
    "$REPLY" "$4"
  printf ' "licenseConcluded": "NOASSERTION", "licenseDeclared": "%s",' "${5:-NOASSERTION}"
  printf ' "copyrightText": "NOASSERTION"}'
  separator=$',\n'
}

# debian_package PREFIX NAME VERSION ARCHITECTURE
debian_package() {
  local more='' id
  if [[ -n ${licenses_of[$2]-} ]]; then
    quote "Debian's copyright file names: ${licenses_of[$2]}"
    more=" \"licenseComments\": $REPLY,"
  fi
  quote "pkg:deb/debian/${2//+/%2B}@${3//:/%3A}?arch=$4&distro=debian-12"
  more+=' "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",'
  more+=" \"referenceLocator\": $REPLY}],"
  spdx_id "$1" "$2"
  id=$REPLY
  package "$id" "$2" "$3" "$more"
}

relationship() {
  printf '%s    {"spdxElementId": "%s", "relationshipType": "%s", "relatedSpdxElement": "%s"}' \
    "$separator" "$1" "$2" "$3"
  separator=$',\n'
}

created=$(date -u -d "@${SOURCE_DATE_EPOCH:-$(date +%s)}" +%Y-%m-%dT%H:%M:%SZ)
digest=$( (dpkg-query -W; cat "$compiled_in" "${programs[@]}") | sha256sum | cut -c1-32)
cat <<END
{
  "spdxVersion": "SPDX-2.3",
  "dataLicense": "CC0-1.0",
  "SPDXID": "SPDXRef-DOCUMENT",
  "name": "hulld",
  "documentNamespace": "https://spdx.org/spdxdocs/hulld-$digest",
  "creationInfo": {"created": "$created", "creators": ["Tool: docker/sbom.sh"]},
  "packages": [
END
read_licenses
separator=
for program in "${programs[@]}"; do
  name=$(basename "$program")
  spdx_id Program "$name"
  package "$REPLY" "$name" "$("$program" --version | awk '{ print $NF; exit }')" \
    " \"checksums\": [{\"algorithm\": \"SHA256\", \"checksumValue\": \"$(sha256sum "$program" |
      cut -d ' ' -f 1)\"}]," Apache-2.0
done
declare -A seen
while read -r name version architecture; do
  [[ -z ${seen[$name]-} ]] || continue  # The same package of another architecture.
  seen[$name]=yes
  debian_package Package "$name" "$version" "$architecture"
done < <(dpkg-query -W -f '${db:Status-Status} ${Package} ${Version} ${Architecture}\n' |
  sed -n 's/^installed //p')
while read -r name version; do
  debian_package CompiledIn "$name" "$version" "$(dpkg --print-architecture)"
done <"$compiled_in"
printf '\n  ],\n  "relationships": [\n'
separator=
for program in "${programs[@]}"; do
  spdx_id Program "$(basename "$program")"
  id=$REPLY
  relationship SPDXRef-DOCUMENT DESCRIBES "$id"
  linked=$(packages_of_program "$program")
  for name in $linked; do
    spdx_id Package "$name"
    relationship "$id" DYNAMIC_LINK "$REPLY"
  done
  while read -r name _; do
    spdx_id CompiledIn "$name"
    relationship "$REPLY" BUILD_DEPENDENCY_OF "$id"
  done <"$compiled_in"
done
printf '\n  ]\n}\n'
