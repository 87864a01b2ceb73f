#!/usr/bin/env bash
# tools/compare_logs.sh DATA [BUILD]: compares every field of every message of the logs below DATA, of whatever format, with
# what others read of them, as the test logs.oracles does (tests/oracles/genuine.test.mjs).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(realpath "${2:-$here/../build}")
cmake --build "$build" --parallel 1 --target dump_log >&2
TRUNDLE_DATA=$(realpath "$1") "$here/../tests/oracles/run.sh" "$build/tests/oracles/dump_log" "" "$build/tests/oracles" genuine
