#!/usr/bin/env bash
# Fuzzes the targets of tests/fuzz one after the other: cmake --preset fuzz && cmake --build --preset fuzz, then
#
#     tests/fuzz/fuzz.sh [--runs 1000000] [--seconds S] [--into FOLDER] [TARGET...]
#
# Each begins with its kept corpus and grows one of its own in FOLDER (build/fuzz/corpus). Prints what each came to; what was
# found lies in FOLDER/found. Keep a find: mend it, then copy it to tests/fuzz/corpus/TARGET/found-WHAT. --keep then takes of
# the grown corpus what covers as much with few and short files.
set -euo pipefail
cd "$(dirname "$0")/../.."
runs=1000000 seconds=0 into=build/fuzz/corpus keep=no
while [ $# -gt 0 ]; do
  case "$1" in
    --runs) runs=$2; shift 2 ;;
    --seconds) seconds=$2; shift 2 ;;  # for each at most
    --into) into=$2; shift 2 ;;
    --keep) keep=yes; shift ;;
    *) break ;;
  esac
done
[ $# -gt 0 ] || set -- $(grep -o 'Target{"[a-z0-9_]*' tests/fuzz/targets.h | cut -d'"' -f2 | grep -v '^hdf5$')
export ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=0 UBSAN_OPTIONS=print_stacktrace=1
mkdir -p "$into/found"
for target in "$@"; do
  kept=tests/fuzz/corpus/$target grown=$into/$target
  mkdir -p "$grown"
  if [ "$keep" = yes ]; then
    rm -rf "$into/small" && mkdir -p "$into/small"
    build/fuzz/bin/"fuzz_$target" -set_cover_merge=1 "$into/small" "$grown" "$kept" >/dev/null 2>&1
    find "$kept" -type f -name 'way-*' -delete
    find "$into/small" -type f -printf '%s %f\n' | sort -n | head -60 | cut -d' ' -f2 | while read -r file; do
      cmp -s "$into/small/$file" "$kept/$file" || cp "$into/small/$file" "$kept/way-${file:0:8}"
    done
    continue
  fi
  case "$target" in metex | fs9721 | es51922 | scpi | fluke | modbus) longest=128 ;; serial_daq | usb1608g) longest=512 ;; *) longest=4096 ;; esac
  begun=$(date +%s)
  if nice -n 10 build/fuzz/bin/"fuzz_$target" -runs="$runs" -max_total_time="$seconds" -max_len=$longest -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
      -artifact_prefix="$into/found/$target-" "$grown" "$kept" >"$into/$target.log" 2>&1; then found=nothing; else found=SOMETHING; fi
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$into/$target.log")
  echo "$target: ${executions:-?} executions in $(($(date +%s) - begun)) s, found $found"
done
