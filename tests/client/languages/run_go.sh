#!/bin/bash
# Generates, compiles, and runs the Go example of client/LANGUAGES.md against its own server.
#
#   run_go.sh PROGRAMS WORK
#
# PROGRAMS: the directory of hulld. WORK: a directory for its files, which is recreated. Everything
# comes from Debian's packages, listed below; they take half a gigabyte, so docker/packages.txt
# omits them. Exit code 77: a package is missing.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source=$(cd "$here/../../.." && pwd)
programs=$(cd "$1" && pwd)
work=$2
page=$source/client/LANGUAGES.md
extract=$source/tests/pages/extract_code.sh
libraries=/usr/share/gocode
server=
trap '[[ -z $server ]] || { kill "$server"; wait "$server" || true; }' EXIT

for package in golang-go protobuf-compiler protoc-gen-go protoc-gen-go-grpc golang-google-grpc-dev golang-google-genproto-dev \
  golang-google-protobuf-dev golang-github-golang-protobuf-1-5-dev; do
  [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) == installed ]] ||
    { echo "skipped: $package is not installed"; exit 77; }
done

rm -rf "$work"
mkdir -p "$work/src/example"
work=$(cd "$work" && pwd)
cp -r "$source/proto" "$work/proto"
cd "$work"
bash -eu <(bash "$extract" "$page" sh)
mkdir -p src/example.com
mv gen src/example.com/hulld
{
  cat <<'GO'
package main

import (
	"context"
	"fmt"
	"log"
	"os"

	"example.com/hulld/hulldv1"
	"google.golang.org/genproto/googleapis/rpc/errdetails"
	"google.golang.org/grpc"
	"google.golang.org/grpc/status"
)

func run(ctx context.Context, xyz []float64) error {
GO
  bash "$extract" "$page" go | sed 's/"127.0.0.1:50551"/os.Args[1]/'
  cat <<'GO'
	return nil
}

func main() {
	var xyz []float64
	for corner := 0; corner < 8; corner++ {
		xyz = append(xyz, float64(corner>>2), float64(corner>>1&1), float64(corner&1))
	}
	if err := run(context.Background(), xyz); err != nil {
		log.Fatal(err)
	}
}
GO
} >src/example/main.go
GO111MODULE=off GOFLAGS='' GOPATH=$work:$libraries GOCACHE=${GOCACHE:-$work/cache} go build -o collide ./src/example

"$programs/hulld" --store memory --listen 127.0.0.1:0 2>"$work/hulld.log" &
server=$!
until address=$(sed -n 's/.*listening on //p' "$work/hulld.log") && [[ -n $address ]]; do
  kill -0 "$server"
  sleep 0.1
done
said=$(./collide "$address")
[[ $said == RELATION_TOUCHING ]] || { echo "it printed: $said"; exit 1; }
