#!/usr/bin/env bash
# Draws the pictures of docs/page.md anew. pictures.sh BIN OUT
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here/package.json" "$here/package-lock.json" "$work/"
(cd "$work" && npm ci --no-audit --no-fund >npm.log 2>&1) || { tail -3 "$work/npm.log"; exit 1; }
EMTB_BIN=$(cd "$1" && pwd) EMTB_WEB_TESTS=$work EMTB_PICTURES=$(cd "$2" && pwd) node "$here/pictures.mjs"
