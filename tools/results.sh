#!/usr/bin/env bash
# The figures of docs/results/calibration.md, from the real recordings.
# tools/results.sh [PROGRAM [DATA [OUT]]]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
trundle=$(realpath "${1:-build/trundle}")
data=$(realpath "${2:-${TRUNDLE_DATA:-../shared/data}}")
out=$(realpath -m "${3:-out/real}")
repository=$PWD
readonly trundle data out repository

python3 tools/real_recordings.py "$data" "$out"
section() { printf '\n== %s\n' "$*"; }
calibrate() { "$trundle" calibrate "$@"; }

cd "$out/optiodom_diff"
section "optiodom_diff: one session of squares, a free run held out"
calibrate square/231220200040 --hold-out free/020120212354 --robot robot.toml -o one/calibrated.toml
section "optiodom_diff: all sessions"
calibrate square/* circular/* --hold-out free/020120212354 --robot robot.toml -o all/calibrated.toml
for session in square/* circular/*; do
  section "optiodom_diff: $session alone, the free run held out"
  calibrate "$session" --hold-out free/020120212354 --robot robot.toml | grep hold-out
done

cd "$out/censi_calibration"
section "censi_calibration: lmov, with the pose of the laser"
calibrate lmov --robot robot.toml --free reference.x --free reference.y --free reference.heading

cd "$out/optiodom_omni3"
for session in circular/* square/* joystick/*; do
  section "optiodom_omni3: $session"
  calibrate "$session" --robot robot.toml
done

cd "$out/optiodom_omni4"
section "optiodom_omni4: $(echo circular/*)"
calibrate circular/* --robot robot.toml

cd "$out/ese650_skidsteer"
for run in encoders*; do
  section "ese650_skidsteer: $run, no reference"
  calibrate "$run" --robot robot.toml
done

section "pods, all wheels: every session in turn is learned from"
python3 "$repository/tools/pods_results.py" "$trundle" "$out"

section "covariance on other days: learned from 1, 2, 3 and all other sessions"
python3 "$repository/tools/held_out.py" "$trundle" "$out"

section "warthog_drive: asphalt, gravel, ice"
python3 "$repository/tools/warthog_recordings.py" "$data" "$out/warthog"
python3 "$repository/tools/warthog_results.py" "$trundle" "$out/warthog"
