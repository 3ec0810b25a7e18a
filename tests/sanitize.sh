#!/bin/bash
# tests/sanitize.sh [all]: the unit tests under the sanitizers of addresses and undefined behaviour, in two halves at once.
# Without `all`, those in slow_unit_tests.txt are left out: they take more than a second each without sanitizers, or more
# than four with them, together over three quarters of the time.
set -euo pipefail
cd "$(dirname "$0")/.."
./app/setup.sh test
./app/build.sh sanitize unit_tests
filter='*'
[ "${1:-}" = all ] || filter="-$(grep -v '^#' tests/slow_unit_tests.txt | paste -s -d :)"
export UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=detect_leaks=1 MESA_SHADER_CACHE_DISABLE=true GTEST_TOTAL_SHARDS=2
run() { GTEST_SHARD_INDEX=$1 build/sanitize/bin/unit_tests --gtest_brief=1 --gtest_filter="$filter" >"build/sanitize.$1.log" 2>&1; }
run 0 &
first=$!
run 1 && second=0 || second=$?
wait "$first" && first=0 || first=$?
tail -n 40 build/sanitize.0.log build/sanitize.1.log
[ "$first" -eq 0 ] && [ "$second" -eq 0 ]
