#!/usr/bin/env bash
# Runs the fuzz targets one after the other: fuzz.sh FOLDER_OF_PROGRAMS SECONDS [TARGET]
# Prints how many inputs each took. A new input that ends one is kept in fuzz/found/: after the repair it goes into
# fuzz/corpus/. What libFuzzer learns stays in FOLDER_OF_PROGRAMS/corpus/.
set -euo pipefail
programs=$1 seconds=$2 only=${3:-}
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
mkdir -p "$root/fuzz/found"
total=0 failed=0
for program in "$programs"/*_fuzz; do
  target=$(basename "$program" _fuzz)
  [[ -z $only || $only == "$target" ]] || continue
  learned=$programs/corpus/$target
  mkdir -p "$learned"
  log=$programs/$target.log
  words=()  # that mutations would hardly come upon
  [[ ! -f $root/fuzz/$target.dict ]] || words=("-dict=$root/fuzz/$target.dict")
  status=0
  # Megabytes and seconds: far more than the largest input of the corpora takes.
  "$program" "$learned" "$root/fuzz/corpus/$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 \
    "${words[@]}" -artifact_prefix="$root/fuzz/found/$target-" -print_final_stats=1 >"$log" 2>&1 || status=$?
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  total=$((total + ${executions:-0}))
  printf '%-16s %10d executions%s\n' "$target" "${executions:-0}" "$([[ $status -eq 0 ]] || echo "  FAILED: $log")"
  [[ $status -eq 0 ]] || failed=1
done
printf '%-16s %10d executions\n' total "$total"
exit $failed
