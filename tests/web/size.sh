#!/usr/bin/env bash
# JavaScript and CSS stay below 300 kB uncompressed. size.sh FOLDER
set -euo pipefail
cd "$1"
size=$(cat page.js page.css | wc -c)
echo "page.js and page.css: $size bytes"
[ "$size" -lt 300000 ]
