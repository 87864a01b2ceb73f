#!/usr/bin/env bash
# tools/compare_logs.sh DATA [BUILD]: compares every field of every message of the ROS bags, MCAP files, rosbag2
# databases and ULogs below DATA with what the libraries of Foxglove read of them, which npm installs into
# BUILD/compare_logs, and WPILOG and DataFlash with what a reader in Python does that shares nothing with this project.
# Logs are compared as sets of lines: readers by index go by time, ours by place.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
data=$1
build=${2:-$here/../build}
oracle=$build/compare_logs
mkdir -p "$oracle"
cp "$here"/compare_logs/{package.json,dump_log.mjs,dump_ulog.mjs} "$oracle"
(cd "$oracle" && npm install --no-audit --no-fund --silent)
cmake --build "$build" --parallel 1 --target dump_log >&2
failed=0
while IFS= read -r log; do
  "$build/tests/dump_log" "$log" 2>"$oracle/said" | LC_ALL=C sort >"$oracle/ours"
  if [[ $log == *.db3 ]]; then
    python3 "$here/compare_logs/dump_rows.py" "$log" | (cd "$oracle" && node --no-warnings dump_log.mjs -)
  elif [[ $log == *.wpilog || $log == *.bin ]]; then
    python3 "$here/compare_logs/dump_packed.py" "$log"
  elif [[ $log == *.ulg ]]; then
    (cd "$oracle" && node --no-warnings dump_ulog.mjs "$log")
  else
    (cd "$oracle" && node --no-warnings dump_log.mjs "$log")
  fi | LC_ALL=C sort >"$oracle/theirs"
  fields=$(tr ' ' '\n' <"$oracle/ours" | grep -c = || true)
  if cmp -s "$oracle/ours" "$oracle/theirs"; then
    printf 'same  %7d messages %9d fields  %s\n' "$(wc -l <"$oracle/ours")" "$fields" "$log"
  else
    printf 'OTHER %s\n' "$log"
    failed=1
  fi
done < <(find -L "$(realpath "$data")" -name '*.bag' -o -name '*.mcap' -o -name '*.db3' -o -name '*.wpilog' -o -name '*.bin' -o -name '*.ulg' | sort)
exit $failed
