#!/bin/bash
# Installs the Python client into an environment of its own, as described on its page, and runs its
# tests.
#
#   run_tests.sh PROGRAMS WORK [PYTEST_ARGUMENT...]
#
# PROGRAMS: the directory of hulld and hullctl. WORK: the directory of the environment, which is replaced. The Python
# is Debian's, with Debian's packages; nothing is fetched. Exit code 77: one of them is missing.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
programs=$(cd "$1" && pwd)
work=$2
shift 2

python=/usr/bin/python3
for module in grpc numpy google.protobuf pytest setuptools wheel pip venv ensurepip mypy; do
  "$python" -c "import $module" 2>/dev/null || { echo "skipped: $python has no $module"; exit 77; }
done
for program in protoc grpc_python_plugin; do
  command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
done

rm -rf "$work"
mkdir -p "$work"
"$python" -m venv --system-site-packages "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check --no-build-isolation \
  --no-index "$here/../../../client/python"

export HULLD_BINARY=$programs/hulld HULLCTL_BINARY=$programs/hullctl PYTHONDONTWRITEBYTECODE=1
unset HULLCTL_SERVER HULLCTL_CONTEXT HULLD_TOKEN PYTHONPATH MYPYPATH
cd "$work"
"$work/venv/bin/python" -m pytest -p no:cacheprovider -o faulthandler_timeout=120 -q "$@" "$here"
