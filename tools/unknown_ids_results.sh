#!/usr/bin/env bash
# The tables of docs/results/slam-without-names.md, as markdown: filters that must find out which landmark is which, beside
# the same with names; and Victoria Park, which has none. Position errors [m, rms] of the best particle's path (`ekf`: online)
# and of the smoother's, median over the seeds.
# tools/unknown_ids_results.sh [PROGRAM [DATA [OUT [SEEDS [PICTURE]]]]]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
trundle=$(realpath "${1:-build/trundle}")
data=$(realpath "${2:-${TRUNDLE_DATA:-../shared/data}}")
out=$(realpath -m "${3:-out/unknown_ids}")
seeds=${4:-10}
picture=$(realpath -m "${5:-$out/victoria-park}") # and .svg, -odometry.svg
readonly trundle data out seeds picture filters="fastslam2 ekf"

python3 tools/slam_recordings.py "$data" "$out"

# First number of KEY in a JSON document with one key on each line, inside OBJECT.
number() { awk -v object="\"$2\":" -v key="\"$3\":" '$1 == object { inside = 1 } inside && $1 == key { print $2 + 0; exit }' "$1"; }
landmarks() { grep -cv -e '^#' -e '^landmark' "$1/landmarks.csv"; }

# errors_of FILTER SEED ALIGNMENT REFERENCE SLAM_ARGUMENTS...: errors of the filter's path and of the smoother's; landmarks
errors_of() {
  local filter=$1 seed=$2 align=$3 reference=$4 result=$out/result path
  shift 4
  rm -rf "$result"
  "$trundle" slam "$@" --filter "$filter" --seed "$seed" --smooth --quiet -o "$result"
  path=$result/path.csv
  [[ -e $path ]] || path=$result/online.csv
  for path in "$path" "$result/trajectory.csv"; do
    "$trundle" evaluate "$path" "$reference" --align "$align" --json >"$out/evaluation.json"
    printf '%s ' "$(number "$out/evaluation.json" position_m rms)"
  done
  landmarks "$result"
}
# The median of each column.
middle() {
  awk '{ for (i = 1; i <= NF; ++i) value[i, NR] = $i + 0; columns = NF }
    END { for (i = 1; i <= columns; ++i) {
      for (j = 1; j <= NR; ++j) for (k = j + 1; k <= NR; ++k) if (value[i, k] < value[i, j]) {
        swap = value[i, j]; value[i, j] = value[i, k]; value[i, k] = swap }
      printf "%s ", value[i, int((NR + 1) / 2)] } print "" }'
}

# compare NAME ALIGNMENT REFERENCE SLAM_ARGUMENTS...: one row
compare() {
  local name=$1 filter last known hidden
  shift
  printf '| %s ' "$name"
  for filter in $filters; do
    last=$seeds
    [[ $filter != ekf ]] || last=1
    known=$(for seed in $(seq "$last"); do errors_of "$filter" "$seed" "$@"; done | middle)
    hidden=$(for seed in $(seq "$last"); do errors_of "$filter" "$seed" "$@" --unknown-ids; done | middle)
    awk -v k="$known" -v h="$hidden" 'BEGIN { split(k, a, " "); split(h, b, " ")
      printf "| %.3f → %.3f (%.2f) | %.3f → %.3f (%.2f), %d ", a[1], b[1], b[1] / a[1], a[2], b[2], b[2] / a[2], b[3] }'
  done
  echo '|'
}

printf '| with names → without (ratio) |'
for filter in $filters; do printf ' `%s` | smoothed, landmarks |' "$filter"; done
printf '\n|---|'
for filter in $filters; do printf -- '---|---|'; done
echo
for robot in 1 2 3 4 5; do
  compare "MRCLAM 6, robot $robot" se2 "$out/mrclam/Robot$robot" "$data/mrclam/MRCLAM_Dataset6" \
    --robot-number "$robot" --robot "$out/mrclam/robot.toml"
done
start=$(awk -F, 'NR == 2 { printf "%s,%s,%.12g", $2, $3, $4 * 57.29577951308232 }' "$out/lost_in_the_woods/reference.csv")
compare "lost in the woods" none "$out/lost_in_the_woods" "$out/lost_in_the_woods" \
  --robot "$out/lost_in_the_woods/robot.toml" --start="$start"

# What lies within METRES of the trajectory: as many landmarks could those see who look no further.
near_path() {
  awk -F, -v most="$2" '/^#/ || /^time_s/ || /^landmark,/ { next }
    FNR == NR { if (++row % 5 == 0) { x[++n] = $2; y[n] = $3 } next }
    { for (i = 1; i <= n; ++i) if (($2 - x[i])^2 + ($3 - y[i])^2 < most^2) { ++count; next } }
    END { print count + 0 }' "$1/trajectory.csv" "$1/landmarks.csv"
}
# against_gps FILE: rms, median, max
against_gps() {
  "$trundle" evaluate "$1" "$park" --align se2 --json >"$out/evaluation.json"
  printf '%.2f, %.2f, %.2f' "$(number "$out/evaluation.json" position_m rms)" \
    "$(number "$out/evaluation.json" position_m median)" "$(number "$out/evaluation.json" position_m max)"
}

printf '\n| Victoria Park | seconds, all | landmarks | within 20 m of the path | online against GPS: rms, median, max [m] | smoothed |\n'
printf -- '|---|---|---|---|---|---|\n'
park=$out/victoria_park
for filter in fastslam2 ekf; do
  result=$out/park_$filter
  rm -rf "$result"
  before=$(date +%s.%N)
  "$trundle" slam "$park" --robot "$park/robot.toml" --filter "$filter" --unknown-ids --smooth --quiet -o "$result"
  seconds=$(awk -v a="$before" -v b="$(date +%s.%N)" 'BEGIN { print b - a }')
  printf '| `%s` | %.1f | %d | %d | %s | %s |\n' "$filter" "$seconds" "$(landmarks "$result")" \
    "$(near_path "$result" 20)" "$(against_gps "$result/online.csv")" "$(against_gps "$result/trajectory.csv")"
done
mkdir -p "$out/park_odometry"
"$trundle" odometry "$park" --robot "$park/robot.toml" --quiet -o "$out/park_odometry/trajectory.csv"
python3 tools/slam_picture.py "$out/park_odometry" "$picture-odometry.svg" "$park/reference.csv"
python3 tools/slam_picture.py "$out/park_fastslam2" "$picture.svg" "$park/reference.csv"
