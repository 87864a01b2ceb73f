#!/usr/bin/env bash
# How large and how fast the page of an hour at 200 Hz is: tools/page_speed.sh PROGRAM OUT
# OUT must have the packages of tests/browser (ctest -L browser installs them into build/tests/browser).
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")
out=$(realpath "$2")
readonly trundle=$1 out here

[[ -e $out/hour/slam/steps.csv ]] || "$here/page_speed.py" "$out/hour"
started=$(date +%s%3N)
"$trundle" report "$out/hour" -o "$out/hour.html" --quiet
printf 'drawn in                    %s ms\n' $(($(date +%s%3N) - started))
printf 'size of the page            %.1f MB\n' "$(awk -v bytes="$(stat -c %s "$out/hour.html")" 'BEGIN { print bytes / 1e6 }')"
CHROMIUM=$(command -v chromium) TRUNDLE_BROWSER_WORK=$out node "$here/../tests/browser/speed.mjs" "$out/hour.html"
