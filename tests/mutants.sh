#!/bin/sh
# Puts the faults of tests/mutants.txt into a copy of the tree, builds it once, and shows for each that its tests fail.
#   tests/mutants.sh [ID...]     all of them, or those whose names begin so
#   tests/mutants.sh --check     only whether each fits the source
# JOBS=2 runs at once; the table is in build/mutants/table.md. Exit code 1 where one was not caught.
set -eu
cd "$(dirname "$0")/.."
# Tests of random cases make all of them.
SELDINGER_ALL_CASES=1 exec python3 tests/mutants.py "$@"
