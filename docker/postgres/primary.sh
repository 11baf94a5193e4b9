#!/bin/bash
# Prepares the primary of docker/compose.many.yaml for replication when its data directory is
# created. The PostgreSQL image runs the files in /docker-entrypoint-initdb.d.
set -euo pipefail
psql --set ON_ERROR_STOP=1 --dbname "$POSTGRES_DB" --command "CREATE ROLE standby REPLICATION LOGIN"
# Trusts all machines of this network, as the database itself does; no other machine can reach it.
echo "host replication standby samenet trust" >>"$PGDATA/pg_hba.conf"
