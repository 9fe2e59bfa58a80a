#!/usr/bin/env bash
# Installs what is missing, builds and tests. Without arguments all of it; or any of:
#   format    clang-format agrees with every source file
#   headers   every header that one room includes from another compiles alone
#   release   all tests, as shipped
#   asan      the tests of the rooms under AddressSanitizer and UndefinedBehaviorSanitizer; not those of whole programs, nor
#             those labelled slow
#   tsan      the tests of what has threads, under ThreadSanitizer
#   numbers   as asan, of model, estimation, diagnosis and the report of it: they take as long to compile as all the rest, too
#             slow for "all of it", where Eigen checks each index in release as well
#   tidy      clang-tidy; as slow
set -euo pipefail
cd "$(dirname "$0")"

sources() { git ls-files '*.cpp' '*.h'; }

build_and_test() {  # preset, all or quick (without the tests labelled slow), then the rooms to test; none: all
  local preset=$1 which=$2 targets=() labels=()
  shift 2
  if [ $# -gt 0 ]; then
    targets=(--target "${@/%/_tests}")
    labels=(-L "^($(IFS='|' && echo "$*"))\$")
  fi
  [ "$which" = all ] || labels+=(-LE '^slow$')
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" "${targets[@]}"
  ctest --preset "$preset" -j "$(nproc)" "${labels[@]}"
}

case "${1:-}" in -h | --help) sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "$0"; exit ;; esac
tools/install_packages.sh
[ $# -gt 0 ] || set -- format headers release asan tsan
for what in "$@"; do
  case "$what" in
    format) echo "== format" && sources | xargs clang-format --dry-run -Werror ;;
    headers)
      echo "== headers"
      cmake --preset release >/dev/null
      cmake --build --preset release --target all_verify_interface_header_sets ;;
    release) build_and_test release all ;;
    numbers) build_and_test asan quick model numerics record fit estimate live diagnose report ;;
    asan) build_and_test asan quick hal experiment export session config drivers fuzz usb comedi figures server daemon ;;
    tsan) build_and_test tsan quick hal drivers server daemon ;;
    tidy) cmake --preset release >/dev/null && sources | grep '\.cpp$' | grep -v '^tests/' | xargs -P "$(nproc)" -n 1 clang-tidy -p build/release --quiet ;;
    *) echo "test.sh: unknown \`$what\`. Known: format, headers, release, asan, tsan, numbers, tidy" >&2; exit 2 ;;
  esac
done
