#!/usr/bin/env bash
# One part of the page's tests in a browser. browser.sh PART WORK BIN: test_PART.mjs, with node modules in WORK and emtb in BIN.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
part=$1 work=$2 bin=$3
"$here/modules.sh" "$work"
EMTB_BIN=$bin EMTB_WEB_TESTS=$work exec node "$here/test_$part.mjs"
