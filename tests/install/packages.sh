#!/bin/bash
# Installs the Debian packages in a bare Debian 12 root, uses each of them, and purges them.
#
#   packages.sh DIRECTORY_OF_PACKAGES
#
# Requires root, debootstrap, and a mirror that apt can reach; otherwise prints the missing
# requirement and exits with 77.
set -euo pipefail

packages=$(cd "$1" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

skip() { echo "skipped: $1"; exit 77; }
((EUID == 0)) || skip "only root can make a root file system"
command -v debootstrap >/dev/null || skip "debootstrap is not installed"
# URI of the archive that apt uses on this machine, in either format of its lists.
mirror=$({ cat /etc/apt/sources.list.d/debian.sources /etc/apt/sources.list 2>/dev/null || true; } |
  sed -n -E '/debian/s/^(URIs:|deb( \[[^]]*\])?) *([^ ]+).*/\3/p' | sed -n 1p)
[[ -n $mirror ]] || skip "apt has no source"

root=$(mktemp -d)
chmod 755 "$root"  # for other users within it
clean_up() {
  umount -l "$root/proc" "$root/dev" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
debootstrap --variant=minbase --include=ca-certificates bookworm "$root" "$mirror" >"$root.log" 2>&1 ||
  { tail -n 5 "$root.log"; rm -f "$root.log"; skip "debootstrap failed"; }
rm -f "$root.log"
mount -t proc proc "$root/proc" && mount --rbind /dev "$root/dev" && mount --make-rslave "$root/dev" ||
  skip "mounting is not permitted"
rm -f "$root/etc/apt/sources.list"
cp -a /etc/apt/. "$root/etc/apt/"
cp -a /usr/share/keyrings/. "$root/usr/share/keyrings/"
cp /etc/resolv.conf /etc/hosts "$root/etc/"
mkdir "$root/packages" "$root/consumer"
cp "$packages"/*.deb "$root/packages/"
cp "$here"/consumer/* "$root/consumer/"

within() {
  env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    chroot "$root" "$@"
}
install_packages() { within apt-get -q install -y --no-install-recommends "$@" >"$root/apt.log" ||
  { tail -n 30 "$root/apt.log"; exit 1; }; }

echo "== the bare root gets g++, cmake, and ninja"
within apt-get -q update >/dev/null
install_packages g++ cmake ninja-build
echo "== install"
install_packages $(cd "$root" && printf '/%s ' packages/*.deb)

echo "== descriptions and licenses"
! within dpkg-query -W -f '${Package}\n${Description}\n' hulld hullctl libhulld-dev python3-hulld |
  grep '^  ' || { echo "these lines are indented twice"; exit 1; }
grep -q 'three.js authors' "$root/usr/share/doc/hullctl/copyright"
echo "== an upgrade keeps the mode of /etc/hulld"
within chmod 700 /etc/hulld
within dpkg -i "/$(cd "$root" && echo packages/hulld_*.deb)" >/dev/null
[[ $(within stat -c %a /etc/hulld) == 700 ]]
within chmod 750 /etc/hulld

echo "== the service's own command line, as its user"
unit=$root/lib/systemd/system/hulld.service
program=$(sed -n 's/^ExecStart=//p' "$unit")
cat >"$root/session.sh" <<'SESSION'
set -euo pipefail
cd /var/lib/hulld
setpriv --reuid hulld --regid hulld --clear-groups \
  env HULLD_CONFIG=/etc/hulld/hulld.toml HULLD_DATA_DIR=/var/lib/hulld HULLD_LISTEN=127.0.0.1:0 \
  "$1" 2>/tmp/log &
server=$!
trap 'kill $server; wait $server || true' EXIT
until address=$(sed -n 's/.*listening on //p' /tmp/log) && [[ -n $address ]]; do
  kill -0 $server || { cat /tmp/log; exit 1; }
  sleep 0.1
done
echo "== hullctl"
printf '%s\n' '0 0 0' '1 0 0' '0 1 0' '0 0 1' |
  hullctl --server "$address" append corner - --create
hullctl --server "$address" check corner corner --pose-b 1,0,0 | tee /tmp/answer
grep -q TOUCHING /tmp/answer
echo "== Python"
python3 - "$address" <<'PYTHON'
import sys
import numpy
import hulld

with hulld.Client(sys.argv[1]) as client:
    client.append_points("box", numpy.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]), create=True)
    answer = client.check_collision("box", "corner")
    assert answer.relation.name == "OVERLAPPING", answer
    print(hulld.__version__, answer.relation.name)
PYTHON
echo "== C++"
cmake -G Ninja -S /consumer -B /tmp/consumer >/tmp/configure.log || { cat /tmp/configure.log; exit 1; }
cmake --build /tmp/consumer >/tmp/build.log || { cat /tmp/build.log; exit 1; }
/tmp/consumer/core_consumer
hullctl --server "$address" create cube >/dev/null
/tmp/consumer/consumer "$address" cube
[[ -s /usr/share/man/man8/hulld.8.gz || -s /usr/share/man/man8/hulld.8 ]]
[[ -s /usr/share/man/man1/hullctl.1.gz || -s /usr/share/man/man1/hullctl.1 ]]
SESSION
within bash /session.sh "$program"

echo "== purge"
within sh -c 'touch /etc/hulld/tokens && chgrp hulld /etc/hulld/tokens'
within apt-get -q purge -y hulld hullctl libhulld-dev python3-hulld >/dev/null
[[ -z $(within find /etc -nogroup) ]]
rm -rf "$root"/{etc/hulld,packages,consumer,session.sh,apt.log} "$root"/tmp/*
left=$(cd "$root" && find . -xdev \( -name proc -o -name dev \) -prune -o \
  \( -iname '*hulld*' -o -iname '*hullctl*' \) -print; grep -s hulld "$root"/etc/passwd "$root"/etc/group || true)
if [[ -n $left ]]; then
  printf 'left behind:\n%s\n' "$left"
  exit 1
fi
echo "nothing is left"
