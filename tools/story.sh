#!/usr/bin/env bash
# The story that run.sh plays: a bench is recorded, a linear model is fitted as Erdal et al. (2011) did, it fails, the diagnosis
# names what is missing, the model gets it, and the error falls on runs that no fit has seen. Then the same on a real machine.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/build/release/bin
work=${EMTB_STORY:-$PWD/build/story}
rm -rf "$work" && mkdir -p "$work"
socket=$(mktemp -d)/emtb.sock  # a socket's path must be short
say() { printf '\n\033[1m%s\033[0m\n' "$*"; }
[ -t 1 ] || say() { printf '\n%s\n' "$*"; }

say "1. The bench: emtbd on the simulated FH2, as fast as it can; six experiments over its socket"
"$bin/emtbd" --config config/benches/fh2-simulated.yaml --socket "$socket" --data "$work/sessions" --pace max \
  >"$work/emtbd.log" 2>&1 &
daemon=$!
trap 'kill $daemon 2>/dev/null || true; rm -rf "${socket%/*}"' EXIT
for _ in $(seq 100); do [ -S "$socket" ] && break; sleep 0.05; done
emtb() { "$bin/emtb" "$@"; }
emtb --socket "$socket" reset
for run in step_low step_mid step_high ramp staircase random; do
  session=$(emtb --socket "$socket" run "fh2_$run")
  mv "$session" "$work/$run.h5"
  echo "$run: $work/$run.h5"
done
kill $daemon && wait $daemon || true
cd "$work"
for run in step_low step_high random staircase; do emtb export $run.h5 --out $run.csv >/dev/null; done  # as if of another logger
configs=$OLDPWD/config
train=(step_low.h5 step_high.h5 ramp.h5 random.h5)
held_out=(step_mid.h5 staircase.h5)

say "2. As the paper did: B and J from the speed of one rising step. B takes up the friction that the model lacks"
emtb calibrate "$configs/models/fh2-one-step.yaml" step_high.h5@0:16 --held-out "${held_out[@]}" --outputs omega --out one-step.yaml

say "3. The linear model, fitted to all training runs, on the held-out ones: where it fails"
emtb compare "$configs/models/fh2.yaml" "${train[@]}" --fit --held-out "${held_out[@]}" --out linear.yaml

say "4. What is missing"
emtb diagnose "$configs/models/fh2.yaml" "${train[@]}" --held-out "${held_out[@]}" --json diagnosis.json | sed '/^Where the model/,/^Candidates/{/^Candidates/!d}'

say "5. Add it, and watch the error fall"
emtb add coulomb_friction linear.yaml "${train[@]}" --held-out "${held_out[@]}" --out with-effect.yaml
emtb report "$configs/models/fh2.yaml" "${train[@]}" --held-out "${held_out[@]}" --png figures   # all of it as a page
echo "the whole story as a page: $work/report.html"

say "6. Table 1 of the paper, continued"
emtb table "$configs/models/fh2-paper-estimated.yaml" "$configs/models/fh2-paper-calibrated.yaml" one-step.yaml linear.yaml with-effect.yaml \
  --truth "$configs/benches/fh2-simulated.yaml"

emps=${EMTB_DATA:-$OLDPWD/../shared/data}/emps/emps.csv
if [ -f "$emps" ]; then
  say "7. A real machine: EMPS, a motor and a ball screw in closed loop (kg, m/s and N for kg m2, rad/s and N m)"
  emtb diagnose "$configs/models/emps.yaml" "$emps@0:14.9" --held-out "$emps@14.9:" --map "$configs/mappings/emps.yaml" \
    --json emps.json | sed -n '/^error (1/,/^$/p;/^unknown_effect/,$p'
  emtb estimate "$emps" --map "$configs/mappings/emps.yaml" --model "$configs/models/emps.yaml"
else
  echo "(no EMPS data: set EMTB_DATA to the folder that holds emps/emps.csv)"
fi
