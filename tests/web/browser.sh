#!/usr/bin/env bash
# One part of the page's tests in a browser. browser.sh PART WORK BIN: test_PART.mjs, with node modules in WORK and emtb in BIN.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
part=$1 work=$2 bin=$3
for command in node npm chromium; do
  command -v "$command" >/dev/null || { echo "skipped: there is no $command"; exit 77; }
done
mkdir -p "$work"
if ! cmp -s "$here/package-lock.json" "$work/package-lock.json" || [ ! -d "$work/node_modules/playwright-core" ]; then
  cp "$here/package.json" "$here/package-lock.json" "$work/"
  (cd "$work" && npm ci --no-audit --no-fund >npm.log 2>&1) || { rm -f "$work/package-lock.json"; echo "skipped: npm ci failed:"; tail -3 "$work/npm.log"; exit 77; }
fi
EMTB_BIN=$bin EMTB_WEB_TESTS=$work exec node "$here/test_$part.mjs"
