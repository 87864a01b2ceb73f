#!/bin/bash
# Prints what a row of a long recording costs: the tables of docs/results/long-recordings.md. On one core.
#
#     tools/long_results.sh [--hours 8] [--program build/trundle] [--in FOLDER]
#
# FOLDER (default: one under /tmp, removed at the end) takes some 15 GB for eight hours.
set -euo pipefail

hours=8 program=build/trundle folder=""
while [ $# -gt 0 ]; do
  case $1 in
    --hours) hours=$2 ;;
    --program) program=$2 ;;
    --in) folder=$2 ;;
    *) sed -n '2,6s/^# \?//p' "$0" >&2; exit 2 ;;
  esac
  shift 2
done

tools=$(cd "$(dirname "$0")" && pwd)
program=$(realpath "$program")
if [ -z "$folder" ]; then
  folder=$(mktemp -d /tmp/trundle_long_XXXXXX)
  trap 'rm -rf "$folder"' EXIT
fi
cd "$folder"
"$tools/long_recording.py" long --hours "$hours" --rate 500
"$tools/long_recording.py" compared --hours "$(awk "BEGIN { print $hours / 8 }")" --rate 500
mkdir out
rm long/reference.csv # wheels and gyro alone
rows_of() { echo $(($(wc -l < "$1/wheels.csv") - 1)); }

# "KB seconds" of a command
costs() {
  /usr/bin/time -f '%M %U %S' -o out/time taskset -c 0 "$program" "$@" > out/stdout
  awk 'END { print $1, $2 + $3 }' out/time
}

read -r empty _ <<< "$(costs --version)"
echo "$(rows_of long) rows, with a reference $(rows_of compared); the program itself takes $((empty / 1024)) MB"
echo "| command | bytes per row | times its numbers | µs per row | in all |"
echo "|---|---|---|---|---|"
# What it is called, recording, command
row() {
  local name=$1 recording=$2
  shift 2
  costs "$1" "$recording" --robot long/robot.toml "${@:2}" | awk -v name="$name" -v rows="$(rows_of "$recording")" -v empty="$empty" '{
    bytes = ($1 - empty) * 1024 / rows
    printf "| `%s` | %.0f | %.2f | %.2f | %.0f s, %.2f GB |\n", name, bytes, bytes / 40, 1e6 * $2 / rows, $2, $1 * 1024 / 1e9
  }'
  rm -rf out/result*
}
row 'odometry -o' long odometry -o out/result.csv
row 'info' long info
row 'slip -o' long slip -o out/result.csv
row 'calibrate -o' long calibrate -o out/result/calibrated.toml
row 'run -o' long run -o out/result
row 'calibrate -o (reference)' compared calibrate -o out/result/calibrated.toml
