#!/bin/sh
# Sets up, builds, and runs the test suite. Arguments go to ctest (for example: -L unit). Without any, all tests run but
# those that take more than ten seconds each, which -L long runs.
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh test
./app/build.sh release
[ $# -gt 0 ] || set -- -LE long
# One more at once than there are processors: windows, Slurm and disks are waited for.
MESA_SHADER_CACHE_DISABLE=true exec ctest --test-dir build/release --output-on-failure -j "$(($(nproc) + 1))" "$@"
