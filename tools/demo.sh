#!/usr/bin/env bash
# The main job on the bundled sample, a simulated robot whose true dimensions are known: calibrate it on three sessions,
# drive a session that the calibration has not seen, find where its wheels slip, map the landmarks that it sees, compare
# each with the truth, draw the report.
# tools/demo.sh PROGRAM SAMPLE OUT
set -euo pipefail
readonly trundle=$1 sample=$2 out=$3
readonly nominal=$sample/robot.toml calibrated=$out/calibrated.toml unseen=$out/unseen/session_01

rm -rf "$out"
mkdir -p "$out"
"$trundle" simulate "$sample/scenario.toml" --seed 7 -o "$out/unseen" --quiet
"$trundle" calibrate "$sample"/session_* --robot "$nominal" --hold-out "$unseen" -o "$calibrated" >"$out/calibrate.txt"
for robot in nominal calibrated; do
  "$trundle" odometry "$unseen/tour" --robot "${!robot}" -o "$out/$robot.csv" --quiet
  "$trundle" evaluate "$out/$robot.csv" "$unseen/tour" --align start --json >"$out/$robot.json"
done
"$trundle" slam "$unseen/tour" --robot "$calibrated" -o "$out/slam" --quiet
"$trundle" evaluate "$out/slam/trajectory.csv" "$unseen/tour" --align start --json >"$out/slam.json"
"$trundle" slip "$sample/slip" --robot "$calibrated" --learn "$sample/session_01/tour" -o "$out/slip.csv" \
  --corrected "$out/slip_corrected.csv" >"$out/slip.txt"
"$trundle" odometry "$sample/slip" --robot "$calibrated" -o "$out/slip_plain.csv" --quiet
for slip in plain corrected; do
  "$trundle" evaluate "$out/slip_$slip.csv" "$sample/slip" --align start --json >"$out/slip_$slip.json"
done
"$trundle" report "$out" -o "$out/report.html" --quiet

# KEY of the N-th wheel in a robot file, and the distance between its two wheels.
wheel() {
  awk -v key="$3" -v n="$2" '/^\[/ { inside = ($1 == "[[wheel]]"); count += inside }
    inside && $1 == key && count == n { print $3; exit }' "$1"
}
track() { awk -v left="$(wheel "$1" 1 y_m)" -v right="$(wheel "$1" 2 y_m)" 'BEGIN { print left - right }'; }
# KEY inside OBJECT of a JSON document with one key on each line.
number() {
  awk -v object="\"$2\":" -v key="\"$3\":" '$1 == object { inside = 1 }
    inside && $1 == key { print $2 + 0; exit }' "$1"
}

row() {
  printf '%-34s' "$1"
  shift
  printf ' %12.5f' "$@"
  printf '\n'
}
robots() { "$1" "$nominal" "${@:2}"; "$1" "$calibrated" "${@:2}"; "$1" "$unseen/truth.toml" "${@:2}"; }
errors() { number "$out/nominal.json" "$@"; number "$out/calibrated.json" "$@"; }

printf '%-34s %12s %12s %12s\n' 'The robot of an unseen session' nominal calibrated truth
mapfile -t values < <(robots wheel 1 diameter_m) && row 'left diameter [m]' "${values[@]}"
mapfile -t values < <(robots wheel 2 diameter_m) && row 'right diameter [m]' "${values[@]}"
mapfile -t values < <(robots track) && row 'track [m]' "${values[@]}"
printf '\n%-34s %12s %12s\n' 'Its tour of 40 m, odometry alone' nominal calibrated
mapfile -t values < <(errors position_m rms) && row 'position error, rms [m]' "${values[@]}"
mapfile -t values < <(errors position_m max) && row 'position error, largest [m]' "${values[@]}"
mapfile -t values < <(errors final position_m) && row 'position error at the end [m]' "${values[@]}"
printf '%-34s %12s %12.5f\n' 'with its landmarks mapped, rms [m]' '' "$(number "$out/slam.json" position_m rms)"
printf '\n%-34s %12s %12s\n' 'A tour on which wheels slip' odometry corrected
slipped() { number "$out/slip_plain.json" "$@"; number "$out/slip_corrected.json" "$@"; }
mapfile -t values < <(slipped position_m rms) && row 'position error, rms [m]' "${values[@]}"
mapfile -t values < <(slipped final position_m) && row 'position error at the end [m]' "${values[@]}"
printf '\nResults: %s   report: %s\n' "$out" "$out/report.html"
