#!/usr/bin/env bash
# The tables 'Without names' of docs/slam-results.md, as markdown: filters that must find out which landmark is which, beside
# the same with names; and Victoria Park, which has none. Position errors [m, rms] of the path, median over the seeds.
# tools/unknown_ids_results.sh [PROGRAM [DATA [OUT [SEEDS [PICTURE]]]]]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
trundle=$(realpath "${1:-build/trundle}")
data=$(realpath "${2:-${TRUNDLE_DATA:-../shared/data}}")
out=$(realpath -m "${3:-out/unknown_ids}")
seeds=${4:-10}
picture=$(realpath -m "${5:-$out/victoria_park.svg}")
readonly trundle data out seeds picture filters="fastslam1 fastslam2 mapso_proposal ekf"

python3 tools/slam_recordings.py "$data" "$out"

# First number of KEY in a JSON document with one key on each line, inside OBJECT.
number() { awk -v object="\"$2\":" -v key="\"$3\":" '$1 == object { inside = 1 } inside && $1 == key { print $2 + 0; exit }' "$1"; }
landmarks() { grep -cv -e '^#' -e '^landmark' "$1/landmarks.csv"; }

# error_of FILTER SEED ALIGNMENT REFERENCE SLAM_ARGUMENTS...: error of the path, landmarks
error_of() {
  local filter=$1 seed=$2 align=$3 reference=$4 result=$out/result path
  shift 4
  rm -rf "$result"
  "$trundle" slam "$@" --filter "$filter" --seed "$seed" --quiet -o "$result"
  path=$result/path.csv
  [[ -e $path ]] || path=$result/trajectory.csv
  "$trundle" evaluate "$path" "$reference" --align "$align" --json >"$out/evaluation.json"
  echo "$(number "$out/evaluation.json" position_m rms) $(landmarks "$result")"
}
middle() { sort -n | awk '{ row[NR] = $0 } END { print row[int((NR + 1) / 2)] }'; }

# compare NAME ALIGNMENT REFERENCE SLAM_ARGUMENTS...: one row
compare() {
  local name=$1 filter last known hidden
  shift
  printf '| %s ' "$name"
  for filter in $filters; do
    last=$seeds
    [[ $filter != ekf ]] || last=1
    known=$(for seed in $(seq "$last"); do error_of "$filter" "$seed" "$@"; done | middle)
    hidden=$(for seed in $(seq "$last"); do error_of "$filter" "$seed" "$@" --unknown-ids; done | middle)
    awk -v k="$known" -v h="$hidden" 'BEGIN { split(k, a, " "); split(h, b, " ")
      printf "| %.3f → %.3f (%.2f), %d ", a[1], b[1], b[1] / a[1], b[2] }'
  done
  echo '|'
}

printf '| with names → without (ratio), landmarks |'
for filter in $filters; do printf ' `%s` |' "$filter"; done
printf '\n|---|---|---|---|---|\n'
for robot in 1 2 3 4 5; do
  compare "MRCLAM 6, robot $robot" se2 "$out/mrclam/Robot$robot" "$data/mrclam/MRCLAM_Dataset6" \
    --robot-number "$robot" --robot "$out/mrclam/robot.toml"
done
start=$(awk -F, 'NR == 2 { printf "%s,%s,%.12g", $2, $3, $4 * 57.29577951308232 }' "$out/lost_in_the_woods/reference.csv")
compare "lost in the woods" none "$out/lost_in_the_woods" "$out/lost_in_the_woods" \
  --robot "$out/lost_in_the_woods/robot.toml" --start="$start"

printf '\n| Victoria Park | seconds | landmarks | online against GPS: rms, median, max [m] | path: rms [m] |\n|---|---|---|---|---|\n'
park=$out/victoria_park
for filter in fastslam2 ekf; do
  result=$out/park_$filter
  rm -rf "$result"
  before=$(date +%s.%N)
  "$trundle" slam "$park" --robot "$park/robot.toml" --filter "$filter" --unknown-ids --quiet -o "$result"
  seconds=$(awk -v a="$before" -v b="$(date +%s.%N)" 'BEGIN { print b - a }')
  "$trundle" evaluate "$result/trajectory.csv" "$park" --align se2 --json >"$out/online.json"
  path=$result/path.csv
  [[ -e $path ]] || path=$result/trajectory.csv
  "$trundle" evaluate "$path" "$park" --align se2 --json >"$out/path.json"
  printf '| `%s` | %.1f | %d | %.2f, %.2f, %.2f | %.2f |\n' "$filter" "$seconds" "$(landmarks "$result")" \
    "$(number "$out/online.json" position_m rms)" "$(number "$out/online.json" position_m median)" \
    "$(number "$out/online.json" position_m max)" "$(number "$out/path.json" position_m rms)"
done
python3 tools/slam_picture.py "$out/park_fastslam2" "$picture" "$park/reference.csv"
