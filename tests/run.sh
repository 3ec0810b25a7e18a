#!/bin/sh
# Sets up, builds, and runs the whole test suite. Arguments go to ctest (for example: -L unit).
set -eu
cd "$(dirname "$0")/.."
./app/setup.sh
./app/build.sh release
MESA_SHADER_CACHE_DISABLE=true exec ctest --test-dir build/release --output-on-failure -j "$(nproc)" "$@"
