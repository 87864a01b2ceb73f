#!/usr/bin/env bash
# How large and how fast the page of an hour at 200 Hz is, and that of 200 folders: tools/page_speed.sh PROGRAM OUT
# OUT must have the packages of tests/browser (ctest -L browser installs them into build/tests/browser).
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")
out=$(realpath "$2")
readonly trundle=$1 out here

[[ -e $out/hour/slam/steps.csv ]] || "$here/page_speed.py" "$out/hour"
measure() {
  local page=$out/$1.html started
  shift
  started=$(date +%s%3N)
  "$trundle" report "$@" -o "$page" --quiet
  printf 'written in                  %s ms\n' $(($(date +%s%3N) - started))
  printf 'size of the page            %.1f MB\n' "$(awk -v bytes="$(stat -c %s "$page")" 'BEGIN { print bytes / 1e6 }')"
  CHROMIUM=$(command -v chromium) TRUNDLE_BROWSER_WORK=$out node "$here/../tests/browser/speed.mjs" "$page"
}

echo 'an hour at 200 Hz'
measure hour "$out/hour"

demo=$here/../data/demo
"$trundle" run "$demo/session_01/tour" --robot "$demo/robot.toml" -o "$out/tour" --quiet
for i in {001..200}; do
  mkdir -p "$out/many/$i"
  cp -r "$out/tour/." "$out/many/$i"
done
echo '200 folders'
measure many "$out"/many/*
