#!/bin/sh
# app/build.sh PRESET [TARGET...]: configure and build, showing the build's output only where it fails.
set -eu
cd "$(dirname "$0")/.."
preset=$1
shift
log=build/$preset.log
mkdir -p build
. ./app/step.sh
[ -f "build/$preset/build.ninja" ] || printf 'build: configuring and building %s (some minutes the first time)\n' "$preset"
step cmake --preset "$preset"
if [ $# -gt 0 ]; then
    step cmake --build "build/$preset" --target "$@"
else
    step cmake --build "build/$preset"
fi
