#!/usr/bin/env bash
# Logs as Trundle decodes them against what other people's libraries write and read: those that are made here
# (written.test.mjs), and the genuine ones below TRUNDLE_DATA or beside the checkout (genuine.test.mjs).
# tests/oracles/run.sh DUMP_LOG PROGRAM WORK_FOLDER [TEST...]
# exit code 77: skipped, where what it takes is not to be had
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
readonly here dump_log=$1 program=$2 work=$3

skip() {
  echo "skipped: $*" >&2
  # A machine that tests every change must have what it takes.
  [[ ${CI:-} != true ]] || exit 1
  exit 77
}

# Exactly the packages that package-lock.json names, checked by its hashes.
install() {
  cmp --silent "$here/package-lock.json" "$work/package-lock.json" && [[ -d $work/node_modules/@mcap ]] && return
  cp "$here/package.json" "$here/package-lock.json" "$work"
  npm ci --prefix "$work" --ignore-scripts --no-audit --no-fund >"$work/npm.log" 2>&1
}

# python3-rosbag would install some 40 packages, 4 MB: those that are missing are unpacked here instead.
unpack_rosbag() {
  [[ ! -d $work/rosbag ]] || return 0
  local packages
  packages=$(apt-get install --simulate --no-install-recommends python3-rosbag | awk '/^Inst/ { print $2 }') || return 1
  rm -rf "$work/debs"
  mkdir -p "$work/debs/root/usr/lib"
  # shellcheck disable=SC2086  # a word each
  (cd "$work/debs" && { [[ -z $packages ]] || apt-get download $packages; } &&
    for package in *.deb; do [[ ! -f $package ]] || dpkg -x "$package" root; done) || return 1
  mv "$work/debs/root" "$work/rosbag"
}

mkdir -p "$work"
for tool in node npm python3 zstd; do
  command -v "$tool" >/dev/null || skip "no $tool: apt-get install nodejs npm python3 zstd"
done
install || { rm -f "$work/package-lock.json"; cat "$work/npm.log" >&2; skip 'npm cannot install what package.json names'; }
# Its modules are of Debian's Python.
export TRUNDLE_PYTHON=/usr/bin/python3
[[ -x $TRUNDLE_PYTHON ]] || TRUNDLE_PYTHON=python3
if { unpack_rosbag || { apt-get -qq update && unpack_rosbag; }; } >"$work/apt.log" 2>&1; then
  export TRUNDLE_ROSBAG=$work/rosbag
else
  cat "$work/apt.log" >&2
  [[ ${CI:-} != true ]] || skip 'apt-get cannot download python3-rosbag'
fi

cp "$here"/*.mjs "$work"  # where their packages are
export TRUNDLE_DUMP_LOG=$dump_log TRUNDLE_PROGRAM=$program TRUNDLE_ORACLES=$here
export TRUNDLE_DATA=${TRUNDLE_DATA:-$here/../../../shared/data}
tests=("${@:4}")
cd "$work"
exec node --no-warnings --test --test-reporter=spec "${tests[@]/%/.test.mjs}"
