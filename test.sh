#!/usr/bin/env bash
# Installs what is missing, builds and tests. Without arguments all of it; or any of:
#   format    clang-format agrees with every source file
#   headers   every header of a room compiles alone
#   release   all tests, as shipped
#   asan      the tests of the rooms under AddressSanitizer and UndefinedBehaviorSanitizer; not those of whole programs
#   tsan      the tests of what has threads, under ThreadSanitizer
#   numbers   as asan, of model, estimation and diagnosis: too slow for "all of it", where Eigen checks each index in release as well
#   tidy      clang-tidy; as slow
set -euo pipefail
cd "$(dirname "$0")"

sources() { git ls-files '*.cpp' '*.h'; }

build_and_test() {  # preset, a pattern of tests to leave out, then the rooms to test; none: all
  local preset=$1 left_out=$2 targets=() labels=()
  shift 2
  if [ $# -gt 0 ]; then
    targets=(--target "${@/%/_tests}")
    labels=(-L "^($(IFS='|' && echo "$*"))\$")
  fi
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" "${targets[@]}"
  ctest --preset "$preset" -j "$(nproc)" "${labels[@]}" -E "$left_out"
}

# Each takes half a minute and more under AddressSanitizer and walks the same code as the shorter ones.
longest='^diagnose:Diagnose\.(NamesTwo|NamesDryFriction|NamesAConstantLoad|NamesWindage|NamesTheLag|HoldsEachRunOut|NamesTheInductance|NamesTheDeadZone|SaysThat|FindsNothingWhereNothingIsHiddenOnTheFast)|^diagnose:FormulaOnOffer\.(NamesWhat|IsTied|IsNotNamed|WithoutAParameter)|^diagnose:(NextExperiment\.AsksForTheCurrent|MissingCurve\.IsZero)|^live:(LiveEstimator\.AnHour|.*LiveCoverage)'

# A minute and more under ThreadSanitizer; the tests of the bench in service have the estimator's thread, too.
most_to_compute='^daemon:EstimatorTest\.'

tools/install_packages.sh
[ $# -gt 0 ] || set -- format headers release asan tsan
for what in "$@"; do
  case "$what" in
    format) echo "== format" && sources | xargs clang-format --dry-run -Werror ;;
    headers)
      echo "== headers"
      cmake --preset release >/dev/null
      cmake --build --preset release --target all_verify_interface_header_sets ;;
    release) build_and_test release "^$" ;;
    numbers) build_and_test asan "$longest" model numerics record fit estimate live diagnose ;;
    asan) build_and_test asan "^$" hal experiment session config drivers usb comedi figures report server daemon ;;
    tsan) build_and_test tsan "$most_to_compute" hal drivers server daemon ;;
    tidy) cmake --preset release >/dev/null && sources | grep '\.cpp$' | grep -v '^tests/' | xargs -P "$(nproc)" -n 1 clang-tidy -p build/release --quiet ;;
    *) echo "test.sh: unknown \`$what\`. Known: format, headers, release, asan, tsan, numbers, tidy" >&2; exit 2 ;;
  esac
done
