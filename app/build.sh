#!/bin/sh
# app/build.sh PRESET [TARGET...]: configure and build, showing the build's output only where it fails.
set -eu
cd "$(dirname "$0")/.."
preset=$1
shift
log=build/$preset.log
mkdir -p build
step() {
    if ! "$@" >"$log" 2>&1; then
        tail -n 40 "$log" >&2
        printf 'build: %s failed; the whole log is in %s\n' "$1 $2" "$log" >&2
        exit 1
    fi
}
[ -f "build/$preset/build.ninja" ] || printf 'build: configuring and building %s (some minutes the first time)\n' "$preset"
step cmake --preset "$preset"
if [ $# -gt 0 ]; then
    step cmake --build "build/$preset" --target "$@"
else
    step cmake --build "build/$preset"
fi
