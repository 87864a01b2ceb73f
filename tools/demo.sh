#!/usr/bin/env bash
# The main job on the bundled sample, a simulated robot whose true dimensions are known: a tour with landmarks on which
# wheels slip goes through all stages of `trundle run`, with the robot calibrated on three other sessions. Where the real
# recordings are ($TRUNDLE_DATA, else ../shared/data), a real robot after that.
# tools/demo.sh PROGRAM SAMPLE OUT
set -euo pipefail
readonly trundle=$1 sample=$2 out=$3
readonly real=${TRUNDLE_DATA:-../shared/data}/optiodom_diff

# KEY of the N-th wheel in a robot file, and the distance between its two wheels.
wheel() {
  awk -v key="$3" -v n="$2" '/^\[/ { inside = ($1 == "[[wheel]]"); count += inside }
    inside && $1 == key && count == n { print $3; exit }' "$1"
}
track() { awk -v left="$(wheel "$1" 1 y_m)" -v right="$(wheel "$1" 2 y_m)" 'BEGIN { print left - right }'; }
# KEY inside "position_m" or "final" of a document with one key on each line.
number() {
  awk -v object="\"$1\":" -v key="\"$2\":" '$1 == object { inside = 1 }
    inside && $1 == key { print $2 + 0; exit }'
}

row() {
  printf '%-34s' "$1"
  shift
  printf ' %12.5f' "$@"
  printf '\n'
}
# LABEL TRAJECTORY RECORDING ROBOT: how far it is from the truth, started where the truth starts.
errors() {
  local document
  document=$("$trundle" evaluate "$2" "$3" --robot "$4" --align start --json)
  row "$1" "$(number position_m rms <<<"$document")" "$(number position_m max <<<"$document")" \
    "$(number final position_m <<<"$document")"
}
# FOLDER RECORDING TITLE: the trajectories of a run, the better ones below.
table() {
  printf '%-34s %12s %12s %12s\n' "$3" rms largest 'at the end'
  errors 'robot as given' "$1/nominal.csv" "$2" "$1/calibrated.toml"
  errors 'robot calibrated' "$1/odometry.csv" "$2" "$1/calibrated.toml"
  [[ ! -e $1/slip.csv ]] || errors '... and slips corrected' "$1/trajectory.csv" "$2" "$1/calibrated.toml"
  [[ ! -e $1/slam ]] || errors '... and landmarks mapped' "$1/slam/trajectory.csv" "$2" "$1/calibrated.toml"
}

# CSV FOLDER: a recording folder over a foreign file, which stays as it is (docs/getting-started.md).
lay_over() {
  mkdir -p "$2"
  cat >"$2/recording.toml" <<TOML
[wheels]
file = "$1"
header = false
increments = true
columns.time_s = 1
columns.right_ticks = 5
columns.left_ticks = 6
[reference]
file = "$1"
header = false
columns.time_s = 1
columns.x_m = 2
columns.y_m = 3
columns.heading_rad = 4
TOML
}
lay_over_session() {
  local file
  for file in "$real/$1"/*_run-*.csv; do lay_over "$(realpath "$file")" "$out/real/recordings/$1/$(basename "$file" .csv)"; done
}

simulated() {
  "$trundle" run "$sample/slip" --robot "$sample/robot.toml" --calibrate-on "$sample"/session_* \
    --learn "$sample/session_01/tour" -o "$out" --quiet
  local robots=("$sample/robot.toml" "$out/calibrated.toml" "$sample/slip/truth.toml") robot
  local left=() right=() tracks=()
  for robot in "${robots[@]}"; do
    left+=("$(wheel "$robot" 1 diameter_m)")
    right+=("$(wheel "$robot" 2 diameter_m)")
    tracks+=("$(track "$robot")")
  done
  printf '%-34s %12s %12s %12s\n' 'A simulated robot' 'as given' calibrated truth
  row 'left diameter [m]' "${left[@]}"
  row 'right diameter [m]' "${right[@]}"
  row 'track [m]' "${tracks[@]}"
  printf '\n'
  table "$out" "$sample/slip" 'Position error on a tour [m]'
  printf '\nResults: %s   report: %s\n' "$out" "$out/report.html"
}

recorded() {
  local robot=$out/real/robot.toml free=free/020120212354/020120212354_run-01 squares=square/231220200040
  lay_over_session "${free%/*}"
  lay_over_session "$squares"
  cat >"$robot" <<'TOML'
name = "optiodom_diff"
[[wheel]]
name = "left"
y_m = 0.1
diameter_m = 0.084
ticks_per_revolution = 2796.8
[[wheel]]
name = "right"
y_m = -0.1
diameter_m = 0.084
ticks_per_revolution = 2796.8
TOML
  "$trundle" run "$out/real/recordings/$free" --robot "$robot" --calibrate-on "$out/real/recordings/$squares" \
    -o "$out/real" --quiet
  printf '\n'
  table "$out/real" "$out/real/recordings/$free" 'A real robot, squares -> free run'
  printf '\nResults: %s   report: %s\n' "$out/real" "$out/real/report.html"
}

rm -rf "$out"
mkdir -p "$(dirname "$out")"
simulated
[[ ! -d $real ]] || recorded
