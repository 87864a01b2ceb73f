#!/usr/bin/env bash
# The report page in a real browser: makes pages with the program, then looks at them (page.test.mjs); with
# TRUNDLE_BROWSER_TEST=fleet the fleet page, made by TRUNDLE_PYTHON (fleet.test.mjs).
# tests/browser/run.sh PROGRAM WORK_FOLDER [OPTIONS OF node --test]
# exit code 77: skipped, where browser or packages are not to be had
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
readonly here program=$1 work=$2

skip() {
  echo "skipped: $*" >&2
  # A machine that tests every change must have what it takes.
  [[ ${CI:-} != true ]] || exit 1
  exit 77
}

browser() {
  local name
  for name in chromium chromium-browser google-chrome; do
    command -v "$name" && return
  done
}

# Exactly the packages that package-lock.json names, checked by its hashes.
install() {
  cmp --silent "$here/package-lock.json" "$work/package-lock.json" && [[ -d $work/node_modules/playwright-core ]] && return
  cp "$here/package.json" "$here/package-lock.json" "$work"
  npm ci --prefix "$work" --ignore-scripts --no-audit --no-fund >"$work/npm.log" 2>&1
}

mkdir -p "$work"
command -v node >/dev/null || skip 'no node: apt-get install nodejs'
command -v npm >/dev/null || skip 'no npm: apt-get install npm'
CHROMIUM=$(browser) || skip 'no browser: apt-get install chromium'
install || { rm -f "$work/package-lock.json"; cat "$work/npm.log" >&2; skip 'npm cannot install playwright-core and axe-core'; }

export CHROMIUM TRUNDLE_PROGRAM=$program TRUNDLE_BROWSER_WORK=$work
exec node --test --test-reporter=spec "${@:3}" "$here/${TRUNDLE_BROWSER_TEST:-page}.test.mjs"
