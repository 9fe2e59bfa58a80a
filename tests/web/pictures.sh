#!/usr/bin/env bash
# Draws the pictures of docs/page.md anew. pictures.sh BIN OUT. The folder that they show is /var/lib/emtb, which must not be there.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
mkdir /var/lib/emtb
work=$(mktemp -d)
trap 'rm -rf "$work" /var/lib/emtb' EXIT
cp "$here/package.json" "$here/package-lock.json" "$work/"
(cd "$work" && npm ci --no-audit --no-fund >npm.log 2>&1) || { tail -3 "$work/npm.log"; exit 1; }
EMTB_TEST_FOLDER=/var/lib/emtb EMTB_BIN=$(cd "$1" && pwd) EMTB_WEB_TESTS=$work EMTB_PICTURES=$(cd "$2" && pwd) node "$here/pictures.mjs"
