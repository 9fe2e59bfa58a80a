#!/usr/bin/env bash
# The page's TypeScript has no type error. types.sh FOLDER
set -euo pipefail
command -v tsc >/dev/null || { echo "skipped: there is no tsc (Debian: node-typescript)"; exit 77; }
cd "$1"
tsc --noEmit -p tsconfig.json
# What comes from a bench or a file is shown as text: nothing of the page writes HTML.
! grep -nE 'innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function' -r src
