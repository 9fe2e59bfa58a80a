#!/usr/bin/env bash
# Makes the pictures and numbers of the pages in this folder, from the outside data (EMTB_DATA, default ../shared/data).
set -euo pipefail
cd "$(dirname "$0")/../.."
emtb=build/release/bin/emtb
data=${EMTB_DATA:-../shared/data}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures=docs/pictures/data
mkdir -p "$pictures"

report() {  # name, then the arguments of emtb report
  local name=$1
  shift
  "$emtb" report "$@" --out "$work/$name.html" --png "$work/$name" --json "$work/$name.json"
}
keep() { cp "$work/$1/$2.png" "$pictures/$1-$3.png"; }  # dataset, plot, its name here

inteco=$data/inteco_servo/inteco_servo.csv
report inteco config/models/inteco.yaml "$inteco#steps_up" "$inteco#coast_pos" --held-out "$inteco#coast_neg" --map config/mappings/inteco.yaml
keep inteco omega_of_inteco_servo.csv_coast_neg_held_out held-out
keep inteco missing_torque_against_omega missing-torque
keep inteco error_steps error

jga25=$data/jga25_steps/jga25_steps.csv
report jga25 config/models/jga25.yaml "$jga25"#s{000..102..2} --held-out "$jga25"#s{001..103..2} --map config/mappings/jga25.yaml
keep jga25 omega_of_jga25_steps.csv_s081_held_out held-out
keep jga25 missing_torque_against_omega missing-torque
keep jga25 error_steps error

emps=$data/emps/emps.csv
report emps config/models/emps.yaml "$emps@0:14.9" --held-out "$emps@14.9:" --map config/mappings/emps.yaml
keep emps missing_torque_against_omega missing-force
keep emps error_steps error
