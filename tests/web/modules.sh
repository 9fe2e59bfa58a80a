#!/usr/bin/env bash
# What the page's tests need of node, put into a folder once. modules.sh WORK; 77: it cannot be had here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$1
for command in node npm chromium; do
  command -v "$command" >/dev/null || { echo "skipped: there is no $command"; exit 77; }
done
mkdir -p "$work"
if ! cmp -s "$here/package-lock.json" "$work/package-lock.json" || [ ! -d "$work/node_modules/playwright-core" ]; then
  cp "$here/package.json" "$here/package-lock.json" "$work/"
  (cd "$work" && npm ci --no-audit --no-fund >npm.log 2>&1) || { rm -f "$work/package-lock.json"; echo "skipped: npm ci failed:"; tail -3 "$work/npm.log"; exit 77; }
fi
