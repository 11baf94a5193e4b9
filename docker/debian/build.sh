#!/bin/bash
# Builds the Debian packages into build/release/packages: hulld, hullctl, libhulld-dev, and
# python3-hulld. Run as root on Debian 12; installs the build's packages first.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

bash docker/packages.sh install build package
[[ -f build/release/CMakeCache.txt ]] || cmake --preset release -DHULLD_BUILD_TESTS=OFF
cmake --build --preset release --target package
ls -1 build/release/packages/*.deb
