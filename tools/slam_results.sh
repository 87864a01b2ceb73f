#!/usr/bin/env bash
# The figures of docs/results/slam.md, from the real recordings. Position errors [m, rms] of each filter: of the whole path
# (the best particle's; of `ekf` and `smoother` the online estimate) and of the online estimate, median and worst over the seeds; of the map, the
# mean NIS and outliers of the median run. Then the smoother started from `fastslam2`: its path, its map, its cost over the degrees of
# freedom instead of NIS, outliers, and seconds of filter and smoother, and of the filter alone.
# tools/slam_results.sh [PROGRAM [DATA [OUT [SEEDS]]]]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
trundle=$(realpath "${1:-build/trundle}")
data=$(realpath "${2:-${TRUNDLE_DATA:-../shared/data}}")
out=$(realpath -m "${3:-out/slam}")
seeds=${4:-10}
readonly trundle data out seeds filters="ekf smoother fastslam1 fastslam2 mapso mapso_proposal"

python3 tools/slam_recordings.py "$data" "$out"

# First number of KEY in a JSON document with one key on each line, inside OBJECT.
number() { awk -v object="\"$2\":" -v key="\"$3\":" '$1 == object { inside = 1 } inside && $1 == key { print $2 + 0; exit }' "$1"; }
# rms [m] of a trajectory against a reference
error() { "$trundle" evaluate "$1" "$2" --align "$3" --json >"$out/evaluation.json"; number "$out/evaluation.json" position_m rms; }

# rms [m] of the landmarks of a map
map_error() {
  local align=()
  [[ $3 != se2 ]] || align=(--align)
  python3 tools/map_error.py "$1" "$2" "${align[@]}"
}

# errors_of FILTER SEED ALIGNMENT REFERENCE LANDMARKS SLAM_ARGUMENTS...: one row of path, online, map, NIS, rejected
errors_of() {
  local filter=$1 seed=$2 align=$3 reference=$4 landmarks=$5 result=$out/result path
  shift 5
  rm -rf "$result"
  "$trundle" slam "$@" --filter "$filter" --seed "$seed" --json -o "$result" >"$out/slam.json"
  path=$result/path.csv
  [[ -e $path ]] || path=$result/trajectory.csv
  echo "$(error "$path" "$reference" "$align") $(error "$result/trajectory.csv" "$reference" "$align")" \
    "$(map_error "$result/landmarks.csv" "$landmarks" "$align") $(number "$out/slam.json" nis mean) $(number "$out/slam.json" sightings rejected)"
}
# The middle line of sorted ones.
middle() { awk '{ row[NR] = $0 } END { print row[int((NR + 1) / 2)] }'; }
summary() {
  local rows median online worst
  rows=$(sort -n)
  read -r -a median < <(middle <<<"$rows")
  read -r worst _ < <(tail -n 1 <<<"$rows")
  online=$(cut -d ' ' -f 2 <<<"$rows" | sort -n | middle)
  printf '%-16s %8.3f %8.3f %8.3f %8.3f %8.2f %9d\n' "$1" "${median[0]}" "$worst" "$online" "${median[2]}" \
    "${median[3]}" "${median[4]}"
}
# Seconds that the program takes with these arguments.
seconds() {
  local start=$EPOCHREALTIME
  "$trundle" "$@" --quiet
  awk -v start="$start" -v end="$EPOCHREALTIME" 'BEGIN { printf "%.2f", end - start }'
}
# smoother ALIGNMENT REFERENCE LANDMARKS SLAM_ARGUMENTS...
smoother() {
  local align=$1 reference=$2 landmarks=$3 result=$out/result
  shift 3
  "$trundle" slam "$@" --smooth --json -o "$result" >"$out/slam.json"
  printf '%-16s %8.3f %8s %8s %8.3f %8.2f %9d %5s s, filter alone %s s\n' smoother \
    "$(error "$result/trajectory.csv" "$reference" "$align")" - - \
    "$(map_error "$result/landmarks.csv" "$landmarks" "$align")" \
    "$(awk "BEGIN { print $(number "$out/slam.json" smoother cost) / $(number "$out/slam.json" smoother degrees_of_freedom) }")" \
    "$(number "$out/slam.json" smoother outliers)" \
    "$(seconds slam "$@" --smooth -o "$result")" "$(seconds slam "$@" -o "$result")"
}
all_filters() {
  printf '%-16s %8s %8s %8s %8s %8s %9s\n' filter path worst online map NIS rejected
  smoother "$@"
  for filter in $filters; do
    last=$seeds
    [[ $filter != ekf && $filter != smoother ]] || last=1
    for seed in $(seq "$last"); do errors_of "$filter" "$seed" "$@"; done | summary "$filter"
  done
}

for robot in 1 2 3 4 5; do
  printf '\n== mrclam dataset 6, robot %s, SE(2)-aligned, %s seeds, 100 particles\n' "$robot" "$seeds"
  all_filters se2 "$out/mrclam/Robot$robot" "$out/mrclam/landmarks.csv" "$data/mrclam/MRCLAM_Dataset6" --robot-number "$robot" \
    --robot "$out/mrclam/robot.toml"
done

printf '\n== lost_in_the_woods, from the true start, not aligned, %s seeds, 100 particles\n' "$seeds"
start=$(awk -F, 'NR == 2 { printf "%s,%s,%.12g", $2, $3, $4 * 57.29577951308232 }' "$out/lost_in_the_woods/reference.csv")
all_filters none "$out/lost_in_the_woods" "$out/lost_in_the_woods/landmarks.csv" "$out/lost_in_the_woods" --robot "$out/lost_in_the_woods/robot.toml" --start="$start"
