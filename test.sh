#!/usr/bin/env bash
# Installs what is missing, builds and tests. Without arguments all of it; or any of:
#   format    clang-format agrees with every source file
#   release   all tests, as shipped
#   asan      all tests under AddressSanitizer and UndefinedBehaviorSanitizer
#   tsan      the tests of what has threads, under ThreadSanitizer
#   tidy      clang-tidy; slow, not part of "all of it"
set -euo pipefail
cd "$(dirname "$0")"

sources() { git ls-files '*.cpp' '*.h'; }

build_and_test() {  # preset, then arguments for ctest
  local preset=$1
  shift
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset"
  ctest --preset "$preset" "$@"
}

tools/install_packages.sh
[ $# -gt 0 ] || set -- format release asan tsan
for what in "$@"; do
  case "$what" in
    format) echo "== format" && sources | xargs clang-format --dry-run -Werror ;;
    release) build_and_test release -j "$(nproc)" ;;
    asan) build_and_test asan -j "$(nproc)" ;;
    tsan) build_and_test tsan -j "$(nproc)" -L 'hal|drivers|daemon|server' ;;
    tidy) cmake --preset release >/dev/null && sources | grep '\.cpp$' | grep -v '^tests/' | xargs -P "$(nproc)" -n 1 clang-tidy -p build/release --quiet ;;
    *) echo "test.sh: unknown \`$what\`. Known: format, release, asan, tsan, tidy" >&2; exit 2 ;;
  esac
done
