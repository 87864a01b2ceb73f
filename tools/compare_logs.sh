#!/usr/bin/env bash
# Compares every field of every message of logs with what the libraries of others read: compare_logs.sh LOG...
# .bag, .mcap and .ulg by npm's @foxglove/rosbag, @mcap/core, @foxglove/rosmsg*-serialization and @foxglove/ulog; .wpilog
# and .bin by a reader in Python that shares nothing with this project. Prints a line for each log. Order does not count.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
place=$root/build/compare_logs
mkdir -p "$place"
cp "$root"/tools/compare_logs/oracle.* "$place"
[[ -d $place/node_modules ]] || npm install --prefix "$place" --silent --no-audit --no-fund @mcap/core@2 @mcap/support@1 \
  @foxglove/rosbag@0.4 @foxglove/rosmsg@5 @foxglove/rosmsg-serialization@2 @foxglove/rosmsg2-serialization@3 @foxglove/ulog@2
cmake --build "$root/build" --parallel 1 --target dump_log >"$place/build.log"
different=0
for log in "$@"; do
  case $log in
    *.bag | *.mcap | *.ulg) (cd "$place" && node oracle.mjs "$(realpath "$log")") ;;
    *) python3 "$place/oracle.py" "$log" ;;
  esac | sort >"$place/theirs"
  "$root/build/dump_log" "$log" 2>"$place/said" | sort >"$place/ours"
  if cmp -s "$place/ours" "$place/theirs"; then
    awk -v name="$log" -v said="$(cat "$place/said")" '{ fields += $(NF - 1) } END { print name ": " NR " messages, " fields " fields: equal" (said == "" ? "" : "; " said) }' "$place/ours"
  else
    echo "$log: $(comm -3 "$place/ours" "$place/theirs" | wc -l) lines differ, the first: $(comm -3 "$place/ours" "$place/theirs" | head -1 | tr '\t' ' ')"
    different=1
  fi
done
exit $different
