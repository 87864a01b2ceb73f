#!/usr/bin/env bash
# The figures of docs/results/slip-real.md, from the real recordings.
# tools/slip_results.sh [PROGRAM [DATA [OUT]]]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tools=$PWD/tools
trundle=$(realpath "${1:-build/trundle}")
data=$(realpath "${2:-${TRUNDLE_DATA:-../shared/data}}")
out=$(realpath -m "${3:-out/slip}")
readonly tools trundle data out

python3 "$tools/slip_recordings.py" "$data" "$out"
section() { printf '\n== %s\n' "$*"; }
# The rms position error of an estimate against a reference, from the start on.
error_of() { "$trundle" evaluate "$1" "$2" --align start --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["position_m"]["rms"])'; }

cd "$out/kobuki_slip"
for interval in 0.25 0.5; do
  for run in nonfaulty_2 left_faulty right_faulty; do
    section "kobuki_slip: $run, intervals of $interval s"
    "$trundle" slip "$run" --robot robot.toml --learn nonfaulty_1 --probability 0.01 --interval-s "$interval" | head -1
  done
done

for run in nonfaulty_1 nonfaulty_2 left_faulty right_faulty; do
  section "kobuki_slip: $run, the gyro's time offset by the estimator, and by cross-correlation"
  "$trundle" calibrate "$run" --robot robot.toml --free gyro.time_offset | grep -e '^gyro.time_offset' -e 'note: gyro.time_offset'
done

# A robot file without its gyro, and without what a calibration says of it.
wheels_alone() { awk '/^\[/ { drop = /^\[+(gyro|calibration)/ } !drop' "$1"; }

# Slips of a recording, its trajectory by the wheels alone, by wheels and gyro without a slip test, and corrected, and
# their errors against a reference.
judge() {
  local run=$1 robot=$2 reference=$3
  shift 3
  "$trundle" slip "$run" --robot "$robot" --learn "$@" --probability 0.001 -o "$run/slip.csv" \
    --corrected "$run/corrected.csv" --quiet
  "$trundle" odometry "$run" --robot "$robot" -o "$run/plain.csv" --quiet
  wheels_alone "$robot" > "$run/wheels_alone.toml"
  "$trundle" odometry "$run" --robot "$run/wheels_alone.toml" -o "$run/wheels_alone.csv" --quiet
  echo "$(error_of "$run/wheels_alone.csv" "$reference") $(error_of "$run/plain.csv" "$reference") $(error_of "$run/corrected.csv" "$reference")" > "$run/errors.txt"
}

cd "$out/kobuki_injected"
section "kobuki_injected: against the odometry of the same log before the injection"
"$trundle" odometry clean --robot robot.toml -o clean/trajectory.csv --quiet
for run in [0-9]*; do judge "$run" robot.toml clean/trajectory.csv clean; done
python3 "$tools/slip_score.py" [0-9]*

cd "$out"
section "omni3_injected: calibrated and learned on one session, against motion capture on the others"
"$trundle" calibrate omni3_clean/circular/221220201643 --robot omni3_clean/robot.toml -o omni3/calibrated.toml --quiet
runs=()
for run in omni3_injected/circular/*/* omni3_injected/square/*/*; do
  [[ $run == */221220201643/* ]] && continue
  judge "$run" omni3/calibrated.toml "$run" omni3_clean/circular/221220201643/*
  runs+=("$run")
done
python3 "$tools/slip_score.py" "${runs[@]}"
