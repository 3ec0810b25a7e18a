#!/bin/bash
# tests/sanitize_python.sh [addresses|threads]: what objects of Python live through (tests/python/test_life.py and
# test_threads.py, or the files given after it) under the sanitizers of addresses and undefined behaviour, or of threads.
# Python itself, NumPy and the rasteriser are not instrumented: what they alone do is not looked at.
set -euo pipefail
cd "$(dirname "$0")/.."
kind=${1:-addresses}
[ $# -eq 0 ] || shift
[ $# -gt 0 ] || set -- tests/python/test_life.py tests/python/test_threads.py
case $kind in
addresses) preset=sanitize library=libasan.so ;;
threads)
    preset=threads library=libtsan.so
    # The sanitizer of threads ends a forked process whose new threads get the numbers of its parent's ("dup thread with used id"),
    # always in this test, now and then in those that fork in test_life.py.
    set -- "$@" --deselect tests/python/test_threads.py::test_a_forked_process_steps_and_is_told_that_it_cannot_make_images
    ;;
*)
    printf "sanitize_python: expected addresses or threads, found '%s'\n" "$kind" >&2
    exit 2
    ;;
esac
./app/setup.sh test
./app/build.sh "$preset" python
# Where Python's own memory is let go at its end, is not our matter: no leaks are looked for.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS="ignore_noninstrumented_modules=1 die_after_fork=0 second_deadlock_stack=1 suppressions=$PWD/tests/threads.supp"
export PYTHONPATH="$PWD/build/$preset/python" PYTHONDONTWRITEBYTECODE=1 MESA_SHADER_CACHE_DISABLE=true
export SELDINGER_TEST_CACHE="$PWD/build/$preset/python-cache"
exec env LD_PRELOAD="$(g++ -print-file-name=$library) $(g++ -print-file-name=libstdc++.so)" \
    /usr/bin/python3 -m pytest -p no:cacheprovider -q --tb=short "$@"
