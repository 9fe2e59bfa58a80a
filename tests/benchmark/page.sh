#!/usr/bin/env bash
# What the page costs and how fast it is, measured on request: docs/page.md#measured says what came out.
#   tests/benchmark/page.sh loop [--pairs 10] [--seconds 20] [--busy]    the loop's lateness with three open pages and without
#   tests/benchmark/page.sh frames [--minutes 10]               frames a second and memory, eight signals
#   tests/benchmark/page.sh stop [--times 100]                  from the click to "reference safe", in mid-run
#   tests/benchmark/page.sh slider [--times 100]                from the slider to the picture, the 56 s run
# Needs node, npm and chromium, as the tests of the page do, and for `loop` the right to SCHED_FIFO (root).
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
bin=${EMTB_BIN:-$here/build/release/bin} work=$here/build/release/web_tests
"$here/tests/web/modules.sh" "$work"
EMTB_BIN=$bin EMTB_WEB_TESTS=$work exec node "$here/tests/benchmark/page.mjs" "$@"
