#!/bin/bash
# Runs the standby of docker/compose.many.yaml: copies the primary at the first start, then follows
# it. PRIMARY is the host name of the primary; the arguments are passed to postgres.
set -euo pipefail
if [[ ! -s $PGDATA/PG_VERSION ]]; then
  until pg_basebackup --pgdata "$PGDATA" --write-recovery-conf --wal-method stream \
    --checkpoint fast --dbname "host=$PRIMARY user=standby application_name=standby"; do
    # Leftovers of an interrupted copy.
    find "$PGDATA" -mindepth 1 -delete
    sleep 1
  done
fi
# The image's directory is world-readable, which postgres rejects.
chmod 0700 "$PGDATA"
exec postgres "$@"
