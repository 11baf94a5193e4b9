#!/bin/bash
# Measures hulld over PostgreSQL, compared with RocksDB, libpq alone, and gRPC alone, and keeps the
# rows in tests/bench/results/postgres/.
#
#   bash tests/bench/postgres/run_postgres_benchmark.sh [MACHINE] [SUITE...]
#
# SUITES: commit queries queries64 bounded ingest fill start cold; all by default. fill creates
# HULLS (1000000) hulls, in parts that take SECONDS_EACH. start and cold use the hulls of the last
# fill, even one of an earlier run, so that "start cold" alone measures another program over the
# same hulls.
#
# Starts a PostgreSQL in FOLDER, /tmp/hulld-bench-postgres by default, with fsync and
# synchronous_commit on, and stops it; existing data is reused. If this script runs as root,
# PostgreSQL runs as the user postgres. MACHINE names the files, as in commit_MACHINE.csv;
# epyc_gcc12 by default. HULLD: a program to measure instead of the one built here. UNDER: a command
# that wraps each measurement, such as one that waits for an idle machine. SECONDS_EACH (60): the
# time per suite. Requires the packages in docker/packages.txt under [build], [bench] and [test].
# Client, servers and database share the machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."

machine=${1:-epyc_gcc12}
shift || true
suites=("$@")
((${#suites[@]} > 0)) || suites=(commit queries queries64 bounded ingest fill start cold)
folder=${FOLDER:-/tmp/hulld-bench-postgres}
results=tests/bench/results/postgres
hulls=${HULLS:-1000000}
# Waiting threads yield their cores to working threads, even if other programs run.
export OMP_WAIT_POLICY=passive

if [[ -z ${BENCHMARK:-} ]]; then
  cmake --preset release -DHULLD_BUILD_BENCH=ON >/dev/null
  cmake --build --preset release --target postgres_benchmark
fi
benchmark=${BENCHMARK:-build/release/bin/postgres_benchmark}

programs=$(pg_config --bindir)
as_server() { if ((EUID == 0)); then runuser -u postgres -- "$@"; else "$@"; fi; }
mkdir -p "$folder"
chmod 755 "$folder"
((EUID != 0)) || chown postgres "$folder"
if [[ ! -e $folder/data/PG_VERSION ]]; then
  # No other user can reach the socket.
  as_server "$programs/initdb" -D "$folder/data" -U postgres --auth=trust --locale=C --encoding=UTF8 >/dev/null
fi
as_server "$programs/pg_ctl" -D "$folder/data" -w -l "$folder/log" start >/dev/null -o "-k $folder \
  -c listen_addresses= -c unix_socket_permissions=0700 -c shared_buffers=1GB -c max_wal_size=8GB \
  -c max_connections=200 -c fsync=on -c synchronous_commit=on -c checkpoint_timeout=30min"
trap 'as_server "$programs/pg_ctl" -D "$folder/data" -w -m fast stop >/dev/null' EXIT

# measure SUITE [FLAG VALUE]...
measure() {
  ${UNDER:-} "$benchmark" "$@" --database "host=$folder user=postgres" --folder "$folder-stores" \
    --hulld "${HULLD:-build/release/bin/hulld}" --seconds "${SECONDS_EACH:-60}"
}
mkdir -p "$folder-stores" "$results"
chmod 700 "$folder-stores"
for suite in "${suites[@]}"; do
  case $suite in
    commit | ingest | queries) measure "$suite" --out "$results/${suite}_$machine.csv" ;;
    queries64) measure queries --clients 64 --out "$results/${suite}_$machine.csv" ;;
    fill)
      from=0
      while ((from < hulls)); do
        measure fill --from "$from" --hulls "$hulls" | tee "$folder-stores/filled"
        from=$(sed -E 's/.* to ([0-9]+):.*/\1/' "$folder-stores/filled")
      done
      ;;
    bounded | cold) measure "$suite" --clients 8 --out "$results/${suite}_$machine.csv" ;;
    start)
      rm -f "$results/start_$machine.csv"
      measure start --out "$results/start_$machine.csv"
      ;;
    *) echo "run_postgres_benchmark.sh: unknown suite $suite" >&2 && exit 2 ;;
  esac
done
# The tables in the pages are about this machine.
if [[ $machine == epyc_gcc12 ]]; then bash tests/bench/tables.sh --write "$machine"; fi
